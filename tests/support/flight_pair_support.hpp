// Two flights with one clock, for tests.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "app/flight_pair.hpp"
#include "support/scene_support.hpp"

namespace pf::test {

inline std::unique_ptr<Backend> cpu(const std::string&, std::int64_t threads) {
  return make_cpu_backend(static_cast<unsigned>(threads));
}

inline Commands split_by(Difference difference) {
  Commands commands;
  commands.split = std::move(difference);
  return commands;
}

inline Settings two_threads(Settings s) {
  s.threads = 2;
  return s;
}

struct Pair {
  explicit Pair(const Settings& settings, Difference difference = {"run.method = spring"})
      : first(two_threads(settings), make_cpu_backend(2)), pair(first, cpu) {
    picture(split_by(std::move(difference)));
  }
  void picture(const Commands& commands = {}) {
    pair.begin(pair.admit(commands), nullptr, nullptr);
    pair.finish();
  }
  Simulation& second() { return *pair.second(); }

  Simulation first;
  FlightPair pair;
};

inline std::uint64_t hash_of(Simulation& flight) { return flight.backend().state_hash(); }

inline Commands edit(const Settings& settings, const std::function<void(Settings&)>& change) {
  Commands commands;
  commands.settings = settings;
  change(*commands.settings);
  return commands;
}

}  // namespace pf::test
