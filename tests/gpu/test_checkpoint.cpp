// A checkpoint of one backend goes on on the other, and on its own, to the same bits.
#include <gtest/gtest.h>

#include "app/run_state.hpp"
#include "data/checkpoint_file.hpp"
#include "data/random_scenes.hpp"
#include "gpu/gpu_scenes.hpp"
#include "unit/temporary_folder.hpp"

namespace pf::test {
namespace {

constexpr unsigned kNumScenes = 30;

using BackendMaker = std::unique_ptr<Backend> (*)();
std::unique_ptr<Backend> on_cpu() { return make_cpu_backend(2); }
std::unique_ptr<Backend> on_gpu() { return make_cuda_backend(0); }

class GpuCheckpoint : public Gpu {
 protected:
  // Runs a scene to its end, saved on one backend and gone on with on another.
  End run(const RandomScene& scene, BackendMaker first, BackendMaker second) {
    const auto file = folder_.path() / "a.state";
    Simulation saved(scene.settings, first());
    advance(saved, scene.saved_after);
    RunState state;
    saved.save(state);
    EXPECT_EQ(state_hash(state), saved.backend().state_hash()) << scene.text;
    write_checkpoint(file, state);
    Simulation again(read_checkpoint(file), second());
    EXPECT_EQ(again.backend().state_hash(), state_hash(state)) << scene.text;
    advance(again, scene.num_frames - scene.saved_after);
    return end_of(again);
  }
  TemporaryFolder folder_;
};

TEST_F(GpuCheckpoint, GoesOnOnEitherBackendToTheSameBits) {
  for (unsigned number = 0; number <= kNumScenes; ++number) {
    const RandomScene scene = number < kNumScenes ? random_scene(number) : heating_scene(8);
    Simulation whole(scene.settings, on_cpu());
    advance(whole, scene.num_frames);
    const End expected = end_of(whole);
    EXPECT_EQ(run(scene, on_cpu, on_gpu), expected) << scene.text << ", from the CPU to the GPU";
    EXPECT_EQ(run(scene, on_gpu, on_cpu), expected) << scene.text << ", from the GPU to the CPU";
    EXPECT_EQ(run(scene, on_gpu, on_gpu), expected) << scene.text << ", on the GPU";
  }
}

// The ball was set in motion when the state was saved, and has not flown since.
TEST_F(GpuCheckpoint, ALaunchInHandIsFlownOnEitherBackend) {
  Settings s = court(500);
  s.method = Method::exact;
  s.magnus = false;  // it keeps its trajectory from step to step
  s.ball_spin_radps = 0.0;
  const auto hash = [&](BackendMaker first, BackendMaker second) {
    SceneRun saved(s, first());
    BallState ball = saved.advance(3, 1e-3).ball;
    ball.velocity_mps = {3.0, 4.0};
    saved.backend->set_ball(ball);
    BackendState state;
    saved.backend->save(state);
    SceneRun again(s, second());
    again.backend->resume(again.physics, state);
    EXPECT_NEAR(again.advance(3, 1e-3).ball.velocity_mps.y, 4.0, 0.1);
    return again.backend->state_hash();
  };
  const std::uint64_t expected = hash(on_cpu, on_cpu);
  EXPECT_EQ(hash(on_gpu, on_cpu), expected);
  EXPECT_EQ(hash(on_cpu, on_gpu), expected);
  EXPECT_EQ(hash(on_gpu, on_gpu), expected);
}

}  // namespace
}  // namespace pf::test
