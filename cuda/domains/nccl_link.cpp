// Motion goes by NCCL, from the GPU of a process to those of others.
#include <fmt/format.h>
#include <nccl.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>

#include "core/timing.hpp"
#include "cuda/domains/links.cuh"
#include "cuda/domains/transfer.cuh"

namespace pf {
namespace {

// Longest wait of a rank for the others to join, and for the motion of another one, which is in the same
// step.
constexpr double kJoinPatience_ms = 30e3, kPatience_ms = 60e3;

// Another rank has not done its part in time. Its own error says more.
struct LateError : DeviceError {
  using DeviceError::DeviceError;
};

// A communicator of all ranks. Its calls return at once, so that none waits without end for a rank that has
// failed. What waits for it must not outlive it.
class Communicator {
 public:
  Communicator() = default;
  ~Communicator() { abort(); }
  Communicator(const Communicator&) = delete;
  Communicator& operator=(const Communicator&) = delete;

  void join(const ncclUniqueId& id, const Carrier& carrier) {
    ncclConfig_t config = NCCL_CONFIG_INITIALIZER;
    config.blocking = 0;
    check(ncclCommInitRankConfig(&handle_, static_cast<int>(carrier.num_ranks()), id,
                                 static_cast<int>(carrier.rank()), &config),
          "ncclCommInitRankConfig");
    wait("joining the processes", kJoinPatience_ms, [] { return true; });
  }
  // exchange() calls send() and receive(), which are one transfer. It is on its stream afterwards.
  template <class Exchange>
  void group(const Exchange& exchange) {
    check(ncclGroupStart(), "ncclGroupStart");
    try {
      exchange();
    } catch (...) {
      ncclGroupEnd();
      abort();
      throw;
    }
    const ncclResult_t result = ncclGroupEnd();
    if (result != ncclSuccess && result != ncclInProgress) abort();
    check(result, "ncclGroupEnd");
    wait("a transfer between processes", kPatience_ms, [] { return true; });
  }
  void send(CudaDomain::Motion motion, unsigned rank, cudaStream_t stream) {
    if (motion.empty()) return;
    check(ncclSend(motion.data(), motion.size_bytes(), ncclInt8, static_cast<int>(rank), handle_, stream),
          "ncclSend");
  }
  void receive(CudaDomain::Motion motion, unsigned rank, cudaStream_t stream) {
    if (motion.empty()) return;
    check(ncclRecv(motion.data(), motion.size_bytes(), ncclInt8, static_cast<int>(rank), handle_, stream),
          "ncclRecv");
  }
  // Until NCCL works on nothing and have_ended(). After an error or too long a time the GPU's part is
  // stopped, since a stream would wait for it without end. Time in which this process was stopped does not
  // count.
  template <class Ended>
  void wait(const char* what, double patience_ms, const Ended& have_ended) {
    constexpr double kLongestTurn_ms = 100.0;
    double waited_ms = 0.0;
    for (Clock::time_point last = Clock::now();; last = Clock::now()) {
      ncclResult_t state = ncclSuccess;
      const ncclResult_t result = ncclCommGetAsyncError(handle_, &state);
      if (result != ncclSuccess) state = result;
      const bool is_working = state == ncclInProgress;
      if (state == ncclSuccess && have_ended()) return;
      waited_ms += std::min(milliseconds_since(last), kLongestTurn_ms);
      const bool is_late = waited_ms > patience_ms;
      if ((state == ncclSuccess || is_working) && !is_late) continue;
      abort();
      check(state, what);
      throw LateError(fmt::format("NCCL: {} has taken {:.0f} s; another process has died or does not go on",
                                  what, 1e-3 * patience_ms));
    }
  }
  // Ends it without the other ranks, which may have ended theirs.
  void abort() {
    if (handle_ != nullptr) ncclCommAbort(handle_);
    handle_ = nullptr;
  }

 private:
  static void check(ncclResult_t result, const char* what) {
    if (result == ncclSuccess || result == ncclInProgress) return;
    const char* details = ncclGetLastError(nullptr);
    const bool has_details = details != nullptr && *details != '\0';
    throw DeviceError(
        fmt::format("NCCL: {}: {}{}{}; NCCL_DEBUG=INFO says more, --domain-link host does without", what,
                    ncclGetErrorString(result), has_details ? ": " : "", has_details ? details : ""));
  }

  ncclComm_t handle_ = nullptr;
};

class NcclLink final : public MotionLink {
 public:
  NcclLink(CudaDomain& domain, Carrier& carrier) : domain_(domain), num_ranks_(carrier.num_ranks()) {}

  // All ranks have the id of rank 0.
  void join(const ncclUniqueId& id, const Carrier& carrier) {
    const DeviceScope scope(domain_.device());
    communicator_.join(id, carrier);
    try_around(carrier.rank());
  }

  std::string name() const override { return fmt::format("NCCL {}", nccl_version_text(nccl_version())); }

  // Also waits on the host for the end, to hear of errors. Meanwhile the GPU sums the contacts of own
  // parcels.
  void update_ghosts() override {
    const DeviceScope scope(domain_.device());
    const cudaStream_t stream = domain_.link_stream();
    communicator_.group([&] {
      for (unsigned rank = 0; rank < num_ranks_; ++rank) {
        communicator_.send(domain_.sent_to(rank), rank, stream);
        communicator_.receive(domain_.ghosts_of(rank), rank, stream);
      }
    });
    domain_.note_transfers();
    communicator_.wait("motion of another process", kPatience_ms,
                       [&] { return domain_.have_transfers_ended(); });
  }

 private:
  // Each rank sends its number to the next one: connects the neighbours, and shows that they hear each other.
  void try_around(unsigned rank) {
    const cudaStream_t stream = domain_.link_stream();
    const DeviceBuffer<ParcelMotion> sent(1), received(1);
    const unsigned next = (rank + 1) % num_ranks_, previous = (rank + num_ranks_ - 1) % num_ranks_;
    ParcelMotion motion{{static_cast<std::int32_t>(rank), 0}, {}};
    to_device(sent.data(), &motion, 1, stream);
    communicator_.group([&] {
      communicator_.send({sent.data(), 1}, next, stream);
      communicator_.receive({received.data(), 1}, previous, stream);
    });
    communicator_.wait("a first message", kJoinPatience_ms, [&] {
      const cudaError_t result = cudaStreamQuery(stream);
      if (result != cudaErrorNotReady) PF_CUDA(result);
      return result == cudaSuccess;
    });
    to_host(&motion, received.data(), 1, stream);
    PF_CUDA(cudaStreamSynchronize(stream));
    if (motion.position.x != static_cast<std::int32_t>(previous))
      throw DeviceError("NCCL: a message came from another process than it should");
  }

  CudaDomain& domain_;
  unsigned num_ranks_;
  Communicator communicator_;
};

// Makes rank 0's identifier; empty if that fails.
std::vector<std::byte> new_id() {
  ncclUniqueId id;
  if (ncclGetUniqueId(&id) != ncclSuccess) return {};
  std::vector<std::byte> bytes(sizeof(id));
  std::memcpy(bytes.data(), &id, sizeof(id));
  return bytes;
}

// Message of a rank to the others after it has tried to join.
struct Outcome {
  bool has_failed = false, is_late = false;
  std::array<char, 400> error{};
};

Outcome failure(const DeviceError& error, unsigned rank, bool is_late) {
  Outcome outcome{true, is_late, {}};
  const std::string text = fmt::format("process {}: {}", rank, error.what());
  std::copy_n(text.begin(), std::min(text.size(), outcome.error.size() - 1), outcome.error.begin());
  return outcome;
}

Outcome try_to_join(NcclLink& link, const std::vector<std::byte>& id_bytes, const Carrier& carrier) {
  try {
    ncclUniqueId id;
    if (id_bytes.size() != sizeof(id))
      throw DeviceError(fmt::format("NCCL: ncclGetUniqueId: {}", ncclGetLastError(nullptr)));
    std::memcpy(&id, id_bytes.data(), sizeof(id));
    link.join(id, carrier);
  } catch (const LateError& error) {
    return failure(error, carrier.rank(), true);
  } catch (const DeviceError& error) {
    return failure(error, carrier.rank(), false);
  }
  return {};
}

// The one that explains most; null: none has failed.
const Outcome* worst(const std::vector<Outcome>& all) {
  const Outcome* found = nullptr;
  for (const Outcome& outcome : all) {
    if (outcome.has_failed && (found == nullptr || (found->is_late && !outcome.is_late))) found = &outcome;
  }
  return found;
}

}  // namespace

int nccl_version() {
  int version = 0;
  return ncclGetVersion(&version) == ncclSuccess ? version : 0;
}

std::unique_ptr<MotionLink> link_by_nccl(CudaDomain& domain, Carrier& carrier, std::string& why) {
  // Messages between pairs of GPUs need no multicast by NVLink's switches, which hosts may share.
  setenv("NCCL_NVLS_ENABLE", "0", 0);
  std::vector<std::byte> id;
  if (carrier.rank() == 0) id = new_id();
  carrier.broadcast(id);
  auto link = std::make_unique<NcclLink>(domain, carrier);
  const Outcome mine = try_to_join(*link, id, carrier);
  std::vector<Outcome> all(carrier.num_ranks());
  carrier.all_gather(&mine, sizeof(mine), all.data());
  if (const Outcome* failed = worst(all)) {
    why = fmt::format("NCCL {} does not work: {}", nccl_version_text(nccl_version()), failed->error.data());
    return nullptr;
  }
  domain.link();
  return link;
}

}  // namespace pf
