#include "app/term_costs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "app/memory.hpp"
#include "app/step_request.hpp"
#include "core/round_up.hpp"
#include "core/statistics.hpp"
#include "scene/derive.hpp"

namespace pf {
namespace {

// Parcels last: their copy is spawned for another number.
constexpr std::array<Term, kNumTerms> kOrder = {Term::contacts, Term::friction, Term::magnus, Term::parcels};
constexpr std::uint32_t kNumWarmUps = 2;  // the first sorts; the second tells how long a step takes
constexpr std::uint32_t kMaxSteps = 64;
constexpr std::size_t kTimedFrames = 60;  // about the last second

}  // namespace

std::string cost_text(const TermCost& cost) {
  constexpr double kClockStep_ms = 1e-4;
  const double margin_ms = std::max(3.0 * cost.error_ms, kClockStep_ms);
  if (std::fabs(cost.ms) <= margin_ms) return fmt::format("< {:g}", round_up(std::fabs(cost.ms) + margin_ms));
  const int digits = std::clamp(static_cast<int>(std::ceil(-std::log10(margin_ms))), 1, 4);
  return fmt::format("{:.{}f} \u00b1 {:.{}f}", cost.ms, digits, margin_ms, digits);
}

TermCost unknown_cost(const Settings& s, Term term) {
  const bool has_parcels = s.air == Air::parcels;
  TermCost cost;
  switch (term) {
    case Term::parcels:
      cost.applies = true;
      cost.is_on = has_parcels;
      break;
    case Term::contacts:
      cost.applies = has_parcels && s.num_parcels > 1;
      cost.is_on = s.contacts;
      break;
    case Term::friction:
      cost.applies = has_parcels && s.ball_present;
      cost.is_on = s.friction > 0.0;
      break;
    default:
      cost.applies = s.ball_present && !s.ball_held;
      cost.is_on = s.magnus;
  }
  return cost;
}

Settings switched(Settings s, Term term) {
  switch (term) {
    case Term::parcels:
      s.air = s.air == Air::parcels ? Air::vacuum : Air::parcels;
      break;
    case Term::contacts:
      s.contacts = !s.contacts;
      break;
    case Term::friction:
      s.friction = s.friction > 0.0 ? 0.0 : Settings{}.friction;
      break;
    default:
      s.magnus = !s.magnus;
  }
  return s;
}

void SteppingCopy::start(const Settings& settings, const TermOrigin& origin) {
  settings_ = settings;
  settings_.num_parcels = resolve_num_parcels(settings, backend_->name());
  dt_s_ = origin.dt_s;
  physics_ = derive_physics(settings_);
  if (num_parcels_ != physics_.parcels.num) {
    const Spawner spawner(settings_, physics_, origin.ball);
    backend_->reset(physics_, spawner.plan(), origin.ball);
    num_parcels_ = physics_.parcels.num;
  } else {
    backend_->set_physics(physics_);
    backend_->set_ball(origin.ball);
  }
  if (origin.parcels.position.size() == *num_parcels_) backend_->restore(origin.parcels);
}

double SteppingCopy::step(std::uint32_t num_steps) {
  return backend_->advance(step_request(settings_, physics_, num_steps, dt_s_)).times.step_ms() / num_steps;
}

void TermCosts::request() {
  is_requested_ = true;
  num_settled_ = kSettlingFrames;
  comparison_.reset();
  state_ = State::settling;
}

void TermCosts::pause() {
  if (!comparison_) return;
  comparison_.reset();
  state_ = State::settling;
}

bool TermCosts::are_of(const FrameView& frame) const {
  return only(*frame.settings, &Effects::cost) == settings_ && frame.backend == backend_;
}

void TermCosts::follow(const FrameView& frame, Backend& backend) {
  if (frame.frame_totals.num_steps == 0 || frame.mid_step || !make_) return;
  if (!are_of(frame)) start_over(frame);
  add_times(frame);
  const bool is_done = state_ == State::known || state_ == State::failed;
  if (is_done || num_settled_++ < kSettlingFrames) return;
  if (!comparison_ && !is_requested_ && !is_cheap(frame)) {
    state_ = State::on_request;
    return;
  }
  state_ = State::measuring;
  try {
    measure(frame, backend);
  } catch (const std::exception& error) {  // no memory for a copy, no room for its parcels, or a lost device
    comparison_.reset();
    failure_ = error.what();
    state_ = State::failed;
  }
}

void TermCosts::start_over(const FrameView& frame) {
  settings_ = only(*frame.settings, &Effects::cost);
  backend_ = frame.backend;
  comparison_.reset();
  is_requested_ = false;
  step_ms_.clear();
  num_frames_ = 0;
  num_settled_ = 0;
  state_ = State::settling;
  for (std::size_t k = 0; k < kNumTerms; ++k) costs_[k] = unknown_cost(*frame.settings, static_cast<Term>(k));
}

void TermCosts::add_times(const FrameView& frame) {
  if (step_ms_.size() < kTimedFrames) step_ms_.push_back(0.0);
  step_ms_[num_frames_++ % step_ms_.size()] =
      frame.times.step_ms() / static_cast<double>(frame.frame_totals.num_steps);
  const double frame_ms = std::min(milliseconds_since(last_frame_), kMaxFrame_ms);
  frame_ms_ += (frame_ms - frame_ms_) / static_cast<double>(step_ms_.size());
  last_frame_ = Clock::now();
}

double TermCosts::median_step_ms() const {
  std::vector<double> values = step_ms_;
  return values.empty() ? 0.0 : median_of(values);
}

double TermCosts::budget_ms() const { return kShare * std::max(frame_ms_, kMinFrame_ms); }

// Allocating on a device takes a time that is not bounded here, so there it is always on request.
bool TermCosts::is_cheap(const FrameView& frame) const {
  return frame.backend == "cpu" && frame.settings->num_parcels <= kMaxParcels &&
         2.0 * median_step_ms() <= budget_ms();
}

// Each call does one thing that takes time: reading the state, making a copy, or a pair of steps.
void TermCosts::measure(const FrameView& frame, Backend& backend) {
  if (!comparison_) return begin(frame, backend);
  Comparison& c = *comparison_;
  for (std::unique_ptr<SteppingCopy>* copy : {&c.as_set, &c.switched}) {
    if (*copy) continue;
    *copy = std::make_unique<SteppingCopy>(make_(backend_, c.origin.settings.threads));
    (*copy)->start(c.origin.settings, c.origin);
    return;
  }
  advance();
}

void TermCosts::begin(const FrameView& frame, Backend& backend) {
  const Settings& s = *frame.settings;
  if (frame.backend == "cpu" && s.air == Air::parcels)
    check_memory(s.num_parcels, 2 * cpu_backend_bytes(s.num_parcels, s.threads, s.method),
                 available_memory_bytes());
  comparison_ = std::make_unique<Comparison>();
  comparison_->origin = {s, frame.ball, backend.snapshot(), frame.dt_s};
}

void TermCosts::advance() {
  go_to_next_term();
  Comparison& c = *comparison_;
  if (c.round == kNumRounds) {
    comparison_.reset();
    is_requested_ = false;
    state_ = State::known;
    return;
  }
  const Term term = kOrder[c.next];
  if (c.num_pairs == 0) {
    c.as_set->start(c.origin.settings, c.origin);
    c.switched->start(switched(c.origin.settings, term), c.origin);
    c.num_steps = 1;
  }
  compare(term);
}

// The term in hand, or the next one of this round or of one that follows.
void TermCosts::go_to_next_term() {
  Comparison& c = *comparison_;
  while (c.round < kNumRounds) {
    if (c.next < kNumTerms && cost(kOrder[c.next]).applies) return;
    if (++c.next < kNumTerms) continue;
    c.next = 0;
    ++c.round;
  }
}

// The halves of a pair take turns in going first.
void TermCosts::compare(Term term) {
  Comparison& c = *comparison_;
  const Clock::time_point start = Clock::now();
  const bool set_first = c.num_pairs % 2 == 0;
  const double first_ms = (set_first ? c.as_set : c.switched)->step(c.num_steps);
  const double second_ms = (set_first ? c.switched : c.as_set)->step(c.num_steps);
  ++c.num_pairs;
  if (c.num_pairs == kNumWarmUps) {
    const double pair_ms = std::max(milliseconds_since(start), 1e-4);
    c.num_steps = static_cast<std::uint32_t>(std::clamp(budget_ms() / pair_ms, 1.0, 1.0 * kMaxSteps));
  }
  if (c.num_pairs <= kNumWarmUps) return;
  const double with_less_without =
      cost(term).is_on == set_first ? first_ms - second_ms : second_ms - first_ms;
  c.differences_ms[static_cast<std::size_t>(term)].push_back(with_less_without);
  if (c.num_pairs < kNumWarmUps + kPairsPerRound) return;
  if (c.round + 1 == kNumRounds) finish(term);
  c.num_pairs = 0;
  ++c.next;
}

// Two pairs with the halves in either order are averaged, so that an advantage of going first cancels. The
// cost is the median of these, with the standard error of a median from their median deviation (1.2533 sigma
// / sqrt(n), sigma = 1.4826 MAD for a normal distribution).
void TermCosts::finish(Term term) {
  const std::vector<double>& differences_ms = comparison_->differences_ms[static_cast<std::size_t>(term)];
  std::vector<double> means_ms;
  for (std::size_t i = 1; i < differences_ms.size(); i += 2)
    means_ms.push_back(0.5 * (differences_ms[i - 1] + differences_ms[i]));
  TermCost& cost = costs_[static_cast<std::size_t>(term)];
  cost.ms = median_of(means_ms);
  for (double& mean : means_ms) mean = std::fabs(mean - cost.ms);
  cost.error_ms = 1.2533 * 1.4826 * median_of(means_ms) / std::sqrt(static_cast<double>(means_ms.size()));
  cost.is_known = true;
}

// Formats the median, and the quartiles if they differ by more than a tenth.
std::string TermCosts::step_text() const {
  std::vector<double> values_ms = step_ms_;
  const double median_ms = median_of(values_ms);
  const double low_ms = value_of_share(values_ms, 0.25);
  const double high_ms = value_of_share(values_ms, 0.75);
  const std::string text = fmt::format("{:.3f} ms a step", median_ms);
  if (high_ms - low_ms <= 0.1 * median_ms) return text;
  return fmt::format("{} (the middle half {:.3f} to {:.3f})", text, low_ms, high_ms);
}

std::string TermCosts::text() const {
  if (step_ms_.empty()) return "";
  std::string line = step_text();
  if (state_ == State::failed) return line + "; its terms cannot be measured: " + failure_;
  if (state_ == State::on_request)
    return line + "; press E to measure its terms (the picture stops for a moment)";
  const char* before = "; ";
  for (std::size_t k = 0; k < kNumTerms; ++k) {
    const TermCost& cost = costs_[k];
    if (!cost.applies) continue;
    line += fmt::format("{}{} {}{}", before, kTermNames[k], cost.is_known ? cost_text(cost) : "measuring",
                        cost.is_on ? "" : " (off)");
    before = ", ";
  }
  return line;
}

nlohmann::json to_json(const TermCosts& costs) {
  nlohmann::json terms = nlohmann::json::object();
  for (std::size_t k = 0; k < kNumTerms; ++k) {
    const TermCost& cost = costs.cost(static_cast<Term>(k));
    if (!cost.applies) continue;
    terms[kTermNames[k]] = nullptr;
    if (cost.is_known)
      terms[kTermNames[k]] = {{"is_on", cost.is_on}, {"ms", cost.ms}, {"error_ms", cost.error_ms}};
  }
  return terms;
}

}  // namespace pf
