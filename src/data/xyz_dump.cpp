#include "data/xyz_dump.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <utility>

#include "core/error.hpp"
#include "core/text.hpp"
#include "scene/derive.hpp"

namespace pf {
namespace {

// error: of errno. remark: after the reason.
[[noreturn]] void fail(const std::filesystem::path& file, int error, const char* remark = "") {
  throw UserError(fmt::format("{}: the dump cannot be written: {}{}", in_quotes(file.string()),
                              std::strerror(error), remark));
}

constexpr const char* kFramesAreComplete = "; its frames up to here are complete";

std::string comment_line(const RunState& state, const Physics& physics) {
  const World& world = physics.world;
  const Vec2d half = to_metres(world, world.half);
  const char wraps = world.boundary == Boundary::periodic ? 'T' : 'F';
  const double depth = 2.0 * physics.parcels.radius_m;
  std::string line = fmt::format(
      "Lattice=\"{} 0 0 0 {} 0 0 0 {}\" Origin=\"{} {} {}\" pbc=\"{} {} F\" "
      "Properties=id:I:1:pos:R:3:velo:R:3:radius:R:1 Time={} Step={}",
      2.0 * half.x, 2.0 * half.y, depth, -half.x, -half.y, -0.5 * depth, wraps, wraps, state.simulated_s,
      state.totals.num_steps);
  if (physics.ball.exists) {
    const BallState& ball = state.backend.ball;
    line += fmt::format(" ball_pos=\"{} {} 0\" ball_velo=\"{} {} 0\" ball_spin={} ball_radius={}",
                        ball.position_m.x, ball.position_m.y, ball.velocity_mps.x, ball.velocity_mps.y,
                        ball.spin_radps, physics.ball.radius_m);
  }
  return line;
}

}  // namespace

std::string xyz_frame(const RunState& state) {
  const Physics physics = derive_physics(state.settings);
  const ParcelSnapshot& parcels = state.backend.parcels;
  const auto num_present = std::count_if(parcels.position.begin(), parcels.position.end(),
                                         [](Vec2i position) { return !is_retired(position); });
  std::string text = fmt::format("{}\n{}\n", num_present, comment_line(state, physics));
  const float radius = static_cast<float>(physics.parcels.radius_m);
  for (std::size_t id = 0; id < parcels.position.size(); ++id) {
    if (is_retired(parcels.position[id])) continue;
    const Vec2d at = to_metres(physics.world, parcels.position[id]);
    const Vec2f v = parcels.velocity[id];
    fmt::format_to(std::back_inserter(text), "{} {} {} 0 {} {} 0 {}\n", id, at.x, at.y, v.x, v.y, radius);
  }
  return text;
}

XyzDump::XyzDump(std::filesystem::path file)
    : file_(std::move(file)), stream_(::open(file_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)) {
  if (!stream_.is_open()) fail(file_, errno);
}

// A frame that could not be written whole is taken back.
void XyzDump::write(const RunState& state) {
  const std::string text = xyz_frame(state);
  if (!stream_.write(text.data(), text.size())) {
    const int error = errno;
    const bool is_taken_back = ::ftruncate(stream_.get(), static_cast<off_t>(num_bytes_)) == 0;
    fail(file_, error, is_taken_back ? kFramesAreComplete : "");
  }
  num_bytes_ += text.size();
}

void XyzDump::finish() {
  if (!stream_.close()) fail(file_, errno);
}

}  // namespace pf
