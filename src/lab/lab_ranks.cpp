#include "lab/lab_ranks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <map>
#include <mutex>
#include <thread>

#include "backend/domains/domain_backend.hpp"
#include "core/error.hpp"
#include "lab/parallel_for.hpp"

namespace pf {
namespace {

using nlohmann::json;

constexpr std::chrono::milliseconds kNap{1};

// CBOR keeps every number as it is.
std::vector<std::byte> bytes_of(const json& value) {
  const std::vector<std::uint8_t> cbor = json::to_cbor(value);
  std::vector<std::byte> bytes(cbor.size());
  std::transform(cbor.begin(), cbor.end(), bytes.begin(), [](std::uint8_t byte) { return std::byte{byte}; });
  return bytes;
}

json json_of(const Letter& letter) {
  std::vector<std::uint8_t> cbor(letter.bytes.size());
  std::transform(letter.bytes.begin(), letter.bytes.end(), cbor.begin(),
                 [](std::byte byte) { return std::to_integer<std::uint8_t>(byte); });
  return json::from_cbor(cbor);
}

json wait_for_order(Carrier& carrier) {
  while (true) {
    if (const auto letter = carrier.try_receive()) return json_of(*letter);
    std::this_thread::sleep_for(kNap);
  }
}

std::vector<LabPoint> plan_of(const std::string& name, const LabContext& context) {
  for (const Study& study : studies()) {
    if (study.name == name) return study.plan(context);
  }
  throw UserError(fmt::format("lab: no study {}", name));
}

const LabPoint& point_of(const std::vector<LabPoint>& plan, const std::string& key) {
  for (const LabPoint& point : plan) {
    if (point.key == key) return point;
  }
  throw UserError(fmt::format("has no point {}; do all processes have the same devices?", key));
}

}  // namespace

// Points in their order, for threads of this rank and for the others.
class LabRanks::Queue {
 public:
  Queue(std::size_t num, const std::atomic<bool>& stop) : num_(num), stop_(stop) {}

  // The next ones, at most so many.
  std::vector<std::size_t> take(unsigned max_num) {
    const std::lock_guard lock(guard_);
    std::vector<std::size_t> taken;
    while (taken.size() < max_num && next_ < num_ && !stop_ && !error_) taken.push_back(next_++);
    return taken;
  }
  void fail(std::exception_ptr error) {
    const std::lock_guard lock(guard_);
    if (!error_) error_ = std::move(error);
  }
  void rethrow() const {
    if (error_) std::rethrow_exception(error_);
  }

 private:
  std::mutex guard_;
  std::size_t num_, next_ = 0;
  const std::atomic<bool>& stop_;
  std::exception_ptr error_;
};

LabRanks::LabRanks(std::shared_ptr<Carrier> carrier, unsigned own_threads, const std::atomic<bool>& stop)
    : carrier_(std::move(carrier)),
      own_threads_(own_threads > 0 ? own_threads : std::max(1U, std::thread::hardware_concurrency())),
      stop_(stop),
      threads_(carrier_->num_ranks()),
      given_(carrier_->num_ranks()) {
  if (carrier_->num_ranks() > 1) leave_domains(*carrier_);
  for (unsigned num_there = 1; num_there < carrier_->num_ranks();) {
    if (const auto letter = carrier_->try_receive()) {
      threads_[letter->rank] = json_of(*letter).get<unsigned>();
      ++num_there;
    } else {
      std::this_thread::sleep_for(kNap);
    }
  }
}

LabRanks::~LabRanks() {
  const auto is_busy = [](const auto& points) { return !points.empty(); };
  while (std::any_of(given_.begin(), given_.end(), is_busy)) {
    if (const auto letter = carrier_->try_receive()) given_[letter->rank].clear();
    std::this_thread::sleep_for(kNap);
  }
  for (unsigned rank = 1; rank < carrier_->num_ranks(); ++rank) carrier_->send(rank, bytes_of(nullptr));
}

void LabRanks::hand_out(const Work& work, const std::function<void(std::size_t)>& before, Queue& queue) {
  for (unsigned rank = 1; rank < carrier_->num_ranks(); ++rank) {
    if (!given_[rank].empty()) continue;
    const std::vector<std::size_t> points = queue.take(work.in_parallel ? threads_[rank] : 1);
    if (points.empty()) continue;
    json keys = json::array();
    for (const std::size_t k : points) {
      before(k);
      keys.push_back(work.points[k].key);
    }
    given_[rank] = points;
    carrier_->send(rank, bytes_of({{"study", work.study}, {"points", keys}}));
  }
}

// Returns whether there was a letter.
bool LabRanks::take_results(const std::function<void(std::size_t, json)>& keep, Queue& queue) {
  const auto letter = carrier_->try_receive();
  if (!letter) return false;
  const std::vector<std::size_t> points = std::move(given_[letter->rank]);
  given_[letter->rank].clear();
  json result = json_of(*letter);
  if (result.contains("error")) {
    const std::string text = fmt::format("rank {}: {}", letter->rank, result["error"].get<std::string>());
    queue.fail(std::make_exception_ptr(UserError(text)));
    return true;
  }
  for (std::size_t k = 0; k < points.size(); ++k) keep(points[k], std::move(result["rows"][k]));
  return true;
}

void LabRanks::measure(const Work& work, const std::function<void(std::size_t)>& before,
                       const std::function<void(std::size_t, json)>& keep) {
  Queue queue(work.points.size(), stop_);
  const auto measure_here = [&](int) {
    for (auto taken = queue.take(1); !taken.empty(); taken = queue.take(1)) {
      try {
        before(taken[0]);
        keep(taken[0], work.points[taken[0]].measure());
      } catch (...) {
        queue.fail(std::current_exception());
      }
    }
  };
  const unsigned num_threads = work.in_parallel ? own_threads_ : 1;
  if (carrier_->num_ranks() == 1) {
    parallel_for(static_cast<int>(num_threads), num_threads, measure_here);
    return queue.rethrow();
  }
  std::jthread here([&] {
    try {
      parallel_for(static_cast<int>(num_threads), num_threads, measure_here);
    } catch (...) {  // threads cannot be started
      queue.fail(std::current_exception());
    }
  });
  const auto is_busy = [](const auto& points) { return !points.empty(); };
  try {
    for (hand_out(work, before, queue); std::any_of(given_.begin(), given_.end(), is_busy);
         hand_out(work, before, queue)) {
      if (!take_results(keep, queue)) std::this_thread::sleep_for(kNap);
    }
  } catch (...) {  // of before() or keep(); the destructor waits for the other ranks
    queue.fail(std::current_exception());
  }
  here.join();
  queue.rethrow();
}

void help_lab(Carrier& carrier, const LabContext& context, unsigned own_threads) {
  carrier.send(0, bytes_of(own_threads));
  std::map<std::string, std::vector<LabPoint>> plans;
  for (json order = wait_for_order(carrier); !order.is_null(); order = wait_for_order(carrier)) {
    const std::string study = order.at("study").get<std::string>();
    const json& keys = order.at("points");
    json rows = json(keys.size(), nullptr);
    try {
      if (!plans.contains(study)) plans[study] = plan_of(study, context);
      parallel_for(static_cast<int>(keys.size()), static_cast<unsigned>(keys.size()), [&](int k) {
        const auto at = static_cast<std::size_t>(k);
        rows[at] = point_of(plans[study], keys[at].get<std::string>()).measure();
      });
      carrier.send(0, bytes_of({{"rows", rows}}));
    } catch (const std::exception& error) {
      carrier.send(0, bytes_of({{"error", error.what()}}));
    }
  }
}

}  // namespace pf
