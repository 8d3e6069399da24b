// The methods: how parcels act on each other. A time-stepped method is a struct with a contact law and a row
// in TimeStepMethods. Loops, kernels, options and panel read these lists; none of them names a method's law.
// The lab's studies have lists of their own.
#pragma once

#include <array>
#include <cassert>
#include <string>
#include <type_traits>
#include <vector>

#include "model/contact.hpp"
#include "model/for_boundary.hpp"

namespace pf {

struct ImpulseMethod {
  static constexpr Method kMethod = Method::impulse;
  static constexpr const char* kName = "impulse";
  // Steps between two tests of a pair for contact. This method acts on the first half of the chord only, as
  // if its steps were twice as long.
  static constexpr double kStepsPerTest = 2.0;
  static constexpr bool kContactsLast = false;
  using Contact = ImpulseContact;
};

struct SpringMethod {
  static constexpr Method kMethod = Method::spring;
  static constexpr const char* kName = "spring";
  static constexpr double kStepsPerTest = 1.0;
  static constexpr bool kContactsLast = true;  // for many steps
  using Contact = SpringContact;
};

// Event-driven; it misses no collision, whatever the step (model/exact).
struct ExactMethod {
  static constexpr Method kMethod = Method::exact;
  static constexpr const char* kName = "exact";
  static constexpr double kStepsPerTest = 0.0;
  static constexpr bool kContactsLast = false;
};

template <class... Methods>
struct MethodList {};

using TimeStepMethods = MethodList<ImpulseMethod, SpringMethod>;
using AllMethods = MethodList<ImpulseMethod, SpringMethod, ExactMethod>;  // in the order of enum Method

struct MethodRow {
  Method method;
  const char* name;  // in scene files, options and reports
  double steps_per_test;
  bool contacts_last;
};

template <class... Methods>
constexpr std::array<MethodRow, sizeof...(Methods)> rows_of(MethodList<Methods...>) {
  return {MethodRow{Methods::kMethod, Methods::kName, Methods::kStepsPerTest, Methods::kContactsLast}...};
}

constexpr auto kMethods = rows_of(AllMethods{});

constexpr const MethodRow& row_of(Method method) { return kMethods[static_cast<std::size_t>(method)]; }

constexpr const char* method_name(Method method) { return row_of(method).name; }

using MethodSet = std::array<bool, kMethods.size()>;  // some of them, by Method

constexpr bool rows_follow_enum() {
  for (std::size_t k = 0; k < kMethods.size(); ++k) {
    if (static_cast<std::size_t>(kMethods[k].method) != k) return false;
  }
  return true;
}
static_assert(rows_follow_enum());

// The other methods, in the order in which a comparison tries them.
constexpr std::array<Method, kMethods.size() - 1> methods_after(Method method) {
  std::array<Method, kMethods.size() - 1> others{};
  for (std::size_t k = 0; k < others.size(); ++k)
    others[k] = kMethods[(static_cast<std::size_t>(method) + k + 1) % kMethods.size()].method;
  return others;
}

inline std::vector<std::string> method_names() {
  std::vector<std::string> names;
  for (const MethodRow& row : kMethods) names.emplace_back(row.name);
  return names;
}

// Stands for the contact law where parcels do not act on each other: loops with it do not search.
struct NoContact {};

template <class Contact>
constexpr bool has_contacts = !std::is_same_v<Contact, NoContact>;

// Returns function.template operator()<M>() for the method M, which is one of the list.
template <class Function, class First, class... Rest>
auto for_method(MethodList<First, Rest...>, Method method, const Function& function) {
  if constexpr (sizeof...(Rest) == 0) {
    assert(method == First::kMethod);
    return function.template operator()<First>();
  } else {
    return method == First::kMethod ? function.template operator()<First>()
                                    : for_method(MethodList<Rest...>{}, method, function);
  }
}

// Returns function.template operator()<Contact, kBall, kBoundary>() for a scene's terms in a time-stepped
// method. A term that is off is compiled out: there is one instance for each combination.
template <class Function>
auto for_terms(const Physics& physics, Method method, const Function& function) {
  return for_boundary(physics.world.boundary, [&]<Boundary kBoundary>() {
    const auto with = [&]<class Contact>() {
      return physics.ball.exists ? function.template operator()<Contact, true, kBoundary>()
                                 : function.template operator()<Contact, false, kBoundary>();
    };
    if (!physics.parcels.contacts) return with.template operator()<NoContact>();
    return for_method(TimeStepMethods{}, method,
                      [&]<class M>() { return with.template operator()<typename M::Contact>(); });
  });
}

}  // namespace pf
