// A backend whose device fails.
#pragma once

#include <memory>
#include <string>

#include "backend/cpu_backend.hpp"
#include "core/error.hpp"

namespace pf::test {

// The CPU backend under another name. Its device fails at one call.
class LosingBackend final : public Backend {
 public:
  enum class At { reset, submit, collect, draw };
  // refuses: it throws UserError, once.
  LosingBackend(At at, int calls_until, bool refuses = false)
      : at_(at), calls_left_(calls_until), refuses_(refuses), real_(make_cpu_backend(1)) {}

  std::string name() const override { return "losing"; }
  std::string device() const override { return "a device"; }
  void reset(const Physics& p, const SpawnPlan& plan, const BallState& b) override {
    lose(At::reset);
    real_->reset(p, plan, b);
  }
  void set_physics(const Physics& p) override { real_->set_physics(p); }
  void set_ball(const BallState& b) override { real_->set_ball(b); }
  void restore(const ParcelSnapshot& s) override { real_->restore(s); }
  void submit(const StepRequest& r) override {
    lose(At::submit);
    real_->submit(r);
  }
  StepReport collect() override {
    lose(At::collect);
    return real_->collect();
  }
  void draw(const DrawBuffers& b) override {
    lose(At::draw);
    real_->draw(b);
  }
  ParcelSnapshot snapshot() override { return real_->snapshot(); }
  void save(BackendState& s) override { real_->save(s); }
  void resume(const Physics& p, const BackendState& s) override { real_->resume(p, s); }
  Measures measure() override { return real_->measure(); }
  std::uint64_t state_hash() override { return real_->state_hash(); }
  std::uint64_t memory_bytes() const override { return real_->memory_bytes(); }
  double min_bytes_moved(const StepTotals& t) const override { return real_->min_bytes_moved(t); }
  double measure_copy_bandwidth(std::size_t n) override { return real_->measure_copy_bandwidth(n); }
  std::string refusal_of(Method) const override { return refusal; }

  std::string refusal;  // of every method

 private:
  void lose(At at) {
    if (at != at_ || calls_left_-- != 0) return;
    if (refuses_) throw UserError("refused");
    throw DeviceError("the device fell off the bus");
  }
  At at_;
  int calls_left_;
  bool refuses_;
  std::unique_ptr<Backend> real_;
};

}  // namespace pf::test
