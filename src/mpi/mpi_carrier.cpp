#include "mpi/mpi_carrier.hpp"

#include <fmt/format.h>
#define OMPI_SKIP_MPICXX 1
#include <mpi.h>
#include <sched.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "core/error.hpp"
#include "core/timing.hpp"
#include "mpi/launcher.hpp"

namespace pf {
namespace {

constexpr double kPatience_ms = 2.0;
constexpr std::chrono::microseconds kNap{100};
constexpr int kLetterTag = 32767;  // the largest that every MPI has

// MPI counts with int. Longer messages go in pieces, which stay in order.
constexpr std::size_t kMaxPiece = std::size_t{1} << 30;

// Calls post(offset, num_bytes) for each piece.
template <class Post>
void in_pieces(std::size_t num_bytes, const Post& post) {
  for (std::size_t offset = 0; offset < num_bytes; offset += kMaxPiece)
    post(offset, static_cast<int>(std::min(kMaxPiece, num_bytes - offset)));
}

// Errors of MPI end all ranks with its own message: MPI_ERRORS_ARE_FATAL is its default.
class MpiCarrier final : public Carrier {
 public:
  MpiCarrier() {
    int level = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &level);
    int rank = 0, num = 0;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &num);
    rank_ = static_cast<unsigned>(rank);
    num_ranks_ = static_cast<unsigned>(num);
    MPI_Comm here = MPI_COMM_NULL;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &here);
    MPI_Comm_size(here, &num);
    MPI_Comm_rank(here, &rank);
    num_ranks_here_ = static_cast<unsigned>(num);
    num_ranks_on_cpus_ = num_with_cpus_of_this(here);
    MPI_Comm_free(&here);
    rank_here_ = static_cast<unsigned>(rank);
  }
  ~MpiCarrier() override { MPI_Finalize(); }
  MpiCarrier(const MpiCarrier&) = delete;
  MpiCarrier& operator=(const MpiCarrier&) = delete;

  unsigned rank() const override { return rank_; }
  unsigned num_ranks() const override { return num_ranks_; }
  unsigned num_ranks_here() const override { return num_ranks_here_; }
  unsigned rank_here() const override { return rank_here_; }
  unsigned num_ranks_on_cpus() const override { return num_ranks_on_cpus_; }

  void broadcast(std::vector<std::byte>& bytes) override {
    std::uint64_t num = bytes.size();
    broadcast_part(&num, 1, MPI_UINT64_T);
    bytes.resize(num);
    in_pieces(num,
              [&](std::size_t offset, int count) { broadcast_part(bytes.data() + offset, count, MPI_BYTE); });
  }

  void all_gather(const void* mine, std::size_t num_bytes, void* all) override {
    const auto count = static_cast<int>(num_bytes);
    MPI_Allgather(mine, count, MPI_BYTE, all, count, MPI_BYTE, MPI_COMM_WORLD);
  }

  void exchange(const std::vector<Outgoing>& out, const std::vector<Incoming>& in) override {
    requests_.clear();
    for (const Incoming& message : in) {
      in_pieces(message.num_bytes, [&](std::size_t offset, int count) {
        MPI_Irecv(static_cast<std::byte*>(message.data) + offset, count, MPI_BYTE,
                  static_cast<int>(message.rank), message.tag, MPI_COMM_WORLD, &requests_.emplace_back());
      });
    }
    for (const Outgoing& message : out) {
      in_pieces(message.num_bytes, [&](std::size_t offset, int count) {
        MPI_Isend(static_cast<const std::byte*>(message.data) + offset, count, MPI_BYTE,
                  static_cast<int>(message.rank), message.tag, MPI_COMM_WORLD, &requests_.emplace_back());
      });
    }
    MPI_Waitall(static_cast<int>(requests_.size()), requests_.data(), MPI_STATUSES_IGNORE);
  }

  // Letters are shorter than 2^31 bytes.
  void send(unsigned rank, const std::vector<std::byte>& bytes) override {
    MPI_Send(bytes.data(), static_cast<int>(bytes.size()), MPI_BYTE, static_cast<int>(rank), kLetterTag,
             MPI_COMM_WORLD);
  }

  std::optional<Letter> try_receive() override {
    int is_there = 0, num = 0;
    MPI_Status status;
    MPI_Iprobe(MPI_ANY_SOURCE, kLetterTag, MPI_COMM_WORLD, &is_there, &status);
    if (is_there == 0) return std::nullopt;
    MPI_Get_count(&status, MPI_BYTE, &num);
    Letter letter{static_cast<unsigned>(status.MPI_SOURCE), {}};
    letter.bytes.resize(static_cast<std::size_t>(num));
    MPI_Recv(letter.bytes.data(), num, MPI_BYTE, status.MPI_SOURCE, kLetterTag, MPI_COMM_WORLD,
             MPI_STATUS_IGNORE);
    return letter;
  }

 private:
  // Ranks of a machine that the launcher has bound to the same CPUs as this one, or to none.
  unsigned num_with_cpus_of_this(MPI_Comm here) const {
    cpu_set_t mine;
    CPU_ZERO(&mine);
    sched_getaffinity(0, sizeof(mine), &mine);
    std::vector<cpu_set_t> all(num_ranks_here_);
    MPI_Allgather(&mine, sizeof(mine), MPI_BYTE, all.data(), sizeof(mine), MPI_BYTE, here);
    return static_cast<unsigned>(std::count_if(
        all.begin(), all.end(), [&](const cpu_set_t& one) { return CPU_EQUAL(&one, &mine) != 0; }));
  }

  // Ranks that wait for an order for long, as while the window is paused, leave their cores to others.
  void broadcast_part(void* data, int count, MPI_Datatype type) const {
    MPI_Request request = MPI_REQUEST_NULL;
    MPI_Ibcast(data, count, type, 0, MPI_COMM_WORLD, &request);
    if (rank_ == 0) {
      MPI_Wait(&request, MPI_STATUS_IGNORE);
      return;
    }
    const Clock::time_point start = Clock::now();
    for (int is_there = 0;;) {
      MPI_Test(&request, &is_there, MPI_STATUS_IGNORE);
      if (is_there != 0) return;
      if (milliseconds_since(start) > kPatience_ms) std::this_thread::sleep_for(kNap);
    }
  }

  unsigned rank_ = 0, num_ranks_ = 1, num_ranks_here_ = 1, num_ranks_on_cpus_ = 1, rank_here_ = 0;
  std::vector<MPI_Request> requests_;
};

std::string mpi_version() {
  char text[MPI_MAX_LIBRARY_VERSION_STRING] = "";
  int length = 0;
  MPI_Get_library_version(text, &length);
  const std::string whole(text, static_cast<std::size_t>(length));
  return whole.substr(0, whole.find(','));
}

}  // namespace

std::shared_ptr<Carrier> join_mpi() {
  const unsigned expected = num_ranks_by_launcher();
  auto carrier = std::make_shared<MpiCarrier>();
  if (carrier->num_ranks() != expected) {
    throw UserError(
        fmt::format("mpirun: it started {} processes, but they find {} of each other; use the "
                    "launcher of the MPI that this program was built with ({})",
                    expected, carrier->num_ranks(), mpi_version()));
  }
  return carrier;
}

void abort_mpi(int exit_code) {
  MPI_Abort(MPI_COMM_WORLD, exit_code);
  std::abort();
}

}  // namespace pf
