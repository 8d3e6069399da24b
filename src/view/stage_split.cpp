// The stage's part in two flights at once.
#include "core/error.hpp"
#include "view/stage_loop.hpp"

namespace pf {
namespace {

constexpr const char* kOfFirst = "Times and figures below: flight 1";

}  // namespace

// A second flight has begun, or not.
void Stage::follow_split(std::int64_t num_begun_before) {
  split_.adopt(switches_.split);
  if (num_frames_ == first_frame_ && !options_.split.empty() && !split_.is_on())
    throw UserError(pair_.view().message);
  if (pair_.num_begun() == num_begun_before) return;
  overlay_.set_terms(kOfFirst);
  fit_camera();
}

// Beside a second flight the overlay says whose figures it has, in place of the terms' costs.
bool Stage::overlay_is_of_first() {
  if (split_.is_on()) {
    overlay_.set_terms(kOfFirst);
  } else if (overlay_.info().terms == kOfFirst) {
    overlay_.set_terms("");
  }
  return split_.is_on();
}

}  // namespace pf
