// The ranks that only do what rank 0 says.
#include <optional>

#include "backend/domains/domain_backend.hpp"
#include "backend/domains/domain_group.hpp"
#include "backend/domains/orders.hpp"
#include "backend/domains/rank_threads.hpp"
#include "core/error.hpp"

namespace pf {
namespace {

struct OpenGroup {
  std::shared_ptr<DomainGpus> gpus;  // null: on processors
  std::optional<DomainGroup> group;
};

void open(Carrier& carrier, Message& message, const FindDomainGpus& find_gpus, OpenGroup& open) {
  const auto num_domains = message.get<unsigned>();
  const auto num_threads = message.get<unsigned>();
  const bool on_gpus = message.get<std::uint8_t>() != 0;
  const auto link = message.get<LinkChoice>();
  open.group.reset();
  open.gpus = on_gpus && find_gpus ? find_gpus() : nullptr;
  if (on_gpus && open.gpus == nullptr)
    throw DeviceError(
        "--cuda: this process has no CUDA device; leave out --cuda, or start no process without one");
  open.group.emplace(carrier, num_domains, threads_of_rank(carrier, num_threads), open.gpus.get());
  open.group->link(link);
}

void reset(Message& message, DomainGroup& group) {
  const auto physics = message.get<Physics>();
  const auto ball = message.get<BallState>();
  const OwnedPlan owned = get_plan(message);
  group.reset(physics, owned.plan, ball);
}

void resume(Message& message, DomainGroup& group) {
  const auto physics = message.get<Physics>();
  const auto ball = message.get<BallState>();
  ParcelSnapshot parcels;
  parcels.step = message.get<std::uint64_t>();
  group.resume(physics, ball, parcels);
}

void restore(Message& message, DomainGroup& group) {
  ParcelSnapshot parcels;
  parcels.step = message.get<std::uint64_t>();
  group.restore(parcels);
}

void gather(DomainGroup& group) {
  ParcelSnapshot none;
  group.gather(none);
}

void count(Message& message, DomainGroup& group) {
  const auto grid = message.get<PixelGrid>();
  const auto style = message.get<CountStyle>();
  group.count(grid, style);
}

void execute(Order order, Message& message, DomainGroup& group) {
  switch (order) {
    case Order::reset:
      return reset(message, group);
    case Order::set_physics:
      return group.set_physics(message.get<Physics>());
    case Order::set_ball:
      return group.set_ball(message.get<BallState>());
    case Order::restore:
      return restore(message, group);
    case Order::resume:
      return resume(message, group);
    case Order::advance:
      return void(group.advance(message.get<StepRequest>()));
    case Order::gather:
      return gather(group);
    case Order::draw:
      return group.draw({});
    case Order::count:
      return count(message, group);
    case Order::gather_in:
      return void(group.gather_in(message.get<PixelGrid>()));
    case Order::measure:
      return void(group.measure());
    case Order::profile:
      return void(group.profile(message.get<ProfileShape>()));
    case Order::state_hash:
      return void(group.state_hash());
    case Order::measure_copy_bandwidth:
      return void(group.measure_copy_bandwidth(message.get<std::size_t>()));
    case Order::open:
    case Order::leave:
    case Order::close:
      return;
  }
}

}  // namespace

Served serve_domains(Carrier& carrier, const FindDomainGpus& find_gpus) {
  OpenGroup served;
  while (true) {
    std::vector<std::byte> bytes;
    carrier.broadcast(bytes);
    Message message(std::move(bytes));
    const auto order = message.get<Order>();
    if (order == Order::close) return Served::ended;
    if (order == Order::leave) return Served::asked_to_leave;
    if (order == Order::open) {
      open(carrier, message, find_gpus, served);
    } else {
      execute(order, message, *served.group);
    }
  }
}

}  // namespace pf
