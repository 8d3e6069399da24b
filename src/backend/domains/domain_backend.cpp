#include "backend/domains/domain_backend.hpp"

#include <fmt/format.h>

#include "backend/domains/domain_group.hpp"
#include "backend/domains/orders.hpp"
#include "backend/domains/rank_threads.hpp"
#include "backend/processor.hpp"
#include "core/error.hpp"

namespace pf {
namespace {

class DomainBackend final : public Backend, public ParcelImages {
 public:
  DomainBackend(std::shared_ptr<Carrier> carrier, unsigned num_domains, unsigned num_threads,
                std::shared_ptr<DomainGpus> gpus, LinkChoice link)
      : carrier_(std::move(carrier)),
        num_domains_(num_domains),
        gpus_(std::move(gpus)),
        group_(*carrier_, num_domains, threads_of_rank(*carrier_, num_threads), gpus_.get()) {
    order(Message()
              .put(Order::open)
              .put(num_domains)
              .put(num_threads)
              .put<std::uint8_t>(gpus_ != nullptr ? 1 : 0)
              .put(link));
    group_.link(link);
  }

  std::string name() const override { return gpus_ != nullptr ? "cuda" : "cpu"; }
  std::string device() const override;
  unsigned num_domains() const override { return num_domains_; }
  std::string domain_link() const override { return group_.link_name(); }
  double share_here() const override {
    return static_cast<double>(carrier_->num_ranks_here()) / carrier_->num_ranks();
  }
  std::string refusal_of(Method method) const override { return refusal_in_domains(method); }
  std::unique_ptr<Backend> with_threads(unsigned num_threads) const override {
    if (gpus_ != nullptr) return nullptr;
    return std::make_unique<DomainBackend>(carrier_, num_domains_, num_threads, nullptr,
                                           LinkChoice::automatic);
  }

  void reset(const Physics& physics, const SpawnPlan& plan, const BallState& ball) override;
  void set_physics(const Physics& physics) override {
    physics_ = physics;
    order(Message().put(Order::set_physics).put(physics));
    group_.set_physics(physics);
  }
  void set_ball(const BallState& ball) override {
    order(Message().put(Order::set_ball).put(ball));
    group_.set_ball(ball);
  }
  void restore(const ParcelSnapshot& snapshot) override {
    together(Message().put(Order::restore).put(snapshot.step), [&] { group_.restore(snapshot); });
  }
  void submit(const StepRequest& request) override;
  StepReport collect() override { return report_; }
  void draw(const DrawBuffers& buffers) override {
    if (buffers.position_m == nullptr) return;
    together(Message().put(Order::draw), [&] { group_.draw(buffers); });
  }
  ParcelImages* images() override { return this; }
  std::vector<std::uint32_t> count(const PixelGrid& grid, const CountStyle& style) override {
    return together(Message().put(Order::count).put(grid).put(style),
                    [&] { return group_.count(grid, style); });
  }
  std::vector<DrawnParcel> gather(const PixelGrid& grid) override {
    return together(Message().put(Order::gather_in).put(grid), [&] { return group_.gather_in(grid); });
  }
  ParcelSnapshot snapshot() override {
    ParcelSnapshot snapshot;
    take_snapshot(snapshot);
    return snapshot;
  }
  void save(BackendState& state) override;
  void resume(const Physics& physics, const BackendState& state) override;
  Measures measure() override {
    return together(Message().put(Order::measure), [&] { return group_.measure(); });
  }
  Profile profile(const ProfileShape& shape) override {
    return together(Message().put(Order::profile).put(shape), [&] { return group_.profile(shape); });
  }
  std::uint64_t state_hash() override {
    return together(Message().put(Order::state_hash), [&] { return group_.state_hash(); });
  }
  std::uint64_t memory_bytes() const override { return group_.memory_bytes(); }
  double min_bytes_moved(const StepTotals& totals) const override {
    return min_step_bytes(physics_.parcels.num, 2 * std::size_t{physics_.parcels.num}, totals);
  }
  double measure_copy_bandwidth(std::size_t num_bytes) override {
    const double bandwidth = together(Message().put(Order::measure_copy_bandwidth).put(num_bytes),
                                      [&] { return group_.measure_copy_bandwidth(num_bytes); });
    if (bandwidth == 0.0)
      throw DeviceError(
          "a process could not measure the copy bandwidth: it lacks memory, or its device failed");
    return bandwidth;
  }

 private:
  // By the GPUs of this rank, before the other ranks hear of anything.
  void check_room(std::size_t num_parcels) const {
    if (gpus_ != nullptr) gpus_->check_room(num_parcels, num_domains_, group_.memory_bytes() / num_domains_);
  }
  void order(Message& message) { carrier_->broadcast(message.bytes()); }
  // The others do what this rank does in `part`.
  template <class Part>
  auto together(Message& message, const Part& part) -> decltype(part()) {
    order(message);
    if (carrier_->num_ranks() == 1) return part();
    try {
      return part();
    } catch (...) {
      throw BrokenRanks{std::current_exception()};
    }
  }
  void take_snapshot(ParcelSnapshot& to) {
    together(Message().put(Order::gather), [&] { group_.gather(to); });
  }

  std::shared_ptr<Carrier> carrier_;
  unsigned num_domains_;
  std::shared_ptr<DomainGpus> gpus_;  // null: on processors
  DomainGroup group_;
  Physics physics_;
  double exact_s_ = 0.0;  // of a state that was resumed
  StepReport report_;     // of the last request
};

std::string DomainBackend::device() const {
  const unsigned num_ranks = carrier_->num_ranks();
  const std::string ranks = num_ranks > 1 ? fmt::format("{} processes of ", num_ranks) : "";
  const std::string device = gpus_ != nullptr ? gpus_->name() : processor_with_threads(group_.num_threads());
  return fmt::format("{} domains, {}{}", num_domains_, ranks, device);
}

void DomainBackend::reset(const Physics& physics, const SpawnPlan& plan, const BallState& ball) {
  check_room(plan.num_parcels);
  physics_ = physics;
  exact_s_ = 0.0;
  Message message;
  message.put(Order::reset).put(physics).put(ball);
  put_plan(message, plan);
  together(message, [&] { group_.reset(physics, plan, ball); });
}

void DomainBackend::submit(const StepRequest& request) {
  if (const std::string refusal = refusal_of(request.method); !refusal.empty()) throw UserError(refusal);
  StepRequest plain = request;
  plain.events = nullptr;
  plain.draw = nullptr;
  report_ = together(Message().put(Order::advance).put(plain), [&] { return group_.advance(plain); });
  if (request.draw) draw(*request.draw);
}

void DomainBackend::save(BackendState& state) {
  take_snapshot(state.parcels);
  state.ball = group_.ball();
  state.ball_was_set = false;
  state.exact_s = exact_s_;
  state.exact = {};
}

void DomainBackend::resume(const Physics& physics, const BackendState& state) {
  check_room(state.parcels.position.size());
  physics_ = physics;
  exact_s_ = state.exact_s;
  together(Message().put(Order::resume).put(physics).put(state.ball).put(state.parcels.step),
           [&] { group_.resume(physics, state.ball, state.parcels); });
}

}  // namespace

std::unique_ptr<Backend> make_domain_backend(std::shared_ptr<Carrier> carrier, unsigned num_domains,
                                             unsigned num_threads, std::shared_ptr<DomainGpus> gpus,
                                             LinkChoice link) {
  return std::make_unique<DomainBackend>(std::move(carrier), num_domains, num_threads, std::move(gpus), link);
}

std::string refusal_in_domains(Method method) {
  if (method != Method::exact) return "";
  return "run.method: exact works in one domain only, since its events hang together across slabs; give "
         "impulse or spring, or leave out --domains and mpirun";
}

void end_domains(Carrier& carrier) { carrier.broadcast(Message().put(Order::close).bytes()); }

void leave_domains(Carrier& carrier) { carrier.broadcast(Message().put(Order::leave).bytes()); }

}  // namespace pf
