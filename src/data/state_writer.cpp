#include "data/state_writer.hpp"

#include <utility>

#include "core/error.hpp"
#include "core/timing.hpp"

namespace pf {

StateWriter::StateWriter(std::unique_ptr<StateSink> sink, std::size_t capacity)
    : sink_(std::move(sink)), capacity_(capacity), thread_([this] { work(); }) {}

StateWriter::~StateWriter() { finish(); }

bool StateWriter::has_room(WhenFull when_full) {
  const Clock::time_point start = Clock::now();
  std::unique_lock lock(mutex_);
  const auto is_ready = [this] { return num_held_ < capacity_ || has_ended(); };
  if (when_full == WhenFull::wait) changed_.wait(lock, is_ready);
  counts_.wait_ms += milliseconds_since(start);
  if (has_ended()) return false;
  if (num_held_ < capacity_) return true;
  ++counts_.num_dropped;
  return false;
}

void StateWriter::add(std::shared_ptr<const RunState> state) {
  const std::scoped_lock lock(mutex_);
  waiting_.push_back(std::move(state));
  ++num_held_;
  changed_.notify_all();
}

void StateWriter::finish() {
  {
    const std::scoped_lock lock(mutex_);
    closed_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

StateWriter::Counts StateWriter::counts() const {
  const std::scoped_lock lock(mutex_);
  return counts_;
}

std::string StateWriter::failure() const {
  const std::scoped_lock lock(mutex_);
  return failure_;
}

std::vector<std::filesystem::path> StateWriter::further_files() const {
  const std::scoped_lock lock(mutex_);
  return further_files_;
}

// Errors end the file, not the run.
template <class Action>
void StateWriter::try_to(const Action& action) {
  std::string failure;
  const Clock::time_point start = Clock::now();
  try {
    action();
  } catch (const std::exception& error) {
    failure = reason_of(error);
  }
  const std::scoped_lock lock(mutex_);
  counts_.write_ms += milliseconds_since(start);
  counts_.num_bytes = sink_->num_bytes();
  further_files_ = sink_->further_files();
  if (failure_.empty()) failure_ = failure;
}

void StateWriter::fail(const std::string& reason) {
  const std::scoped_lock lock(mutex_);
  if (failure_.empty()) failure_ = reason;
}

void StateWriter::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return closed_ || !waiting_.empty(); });
    if (waiting_.empty()) break;
    std::shared_ptr<const RunState> state = std::move(waiting_.front());
    waiting_.pop_front();
    const bool is_wanted = !has_ended();
    if (is_wanted) failure_.clear();  // of the state before
    lock.unlock();
    if (is_wanted) try_to([&] { sink_->write(*state); });
    state.reset();  // its memory can be used again
    lock.lock();
    if (failure_.empty()) ++counts_.num_written;
    --num_held_;
    changed_.notify_all();
  }
  const bool has_failed = !failure_.empty();
  lock.unlock();
  if (!has_failed) try_to([&] { sink_->finish(); });
}

}  // namespace pf
