// Carries bytes between the processes (ranks) that share the domains of a world.
#pragma once

#include <cstddef>
#include <cstring>
#include <optional>
#include <vector>

namespace pf {

// Bytes for a rank. tag: tells messages between two ranks apart, below 2^15.
struct Outgoing {
  unsigned rank;
  int tag;
  const void* data;
  std::size_t num_bytes;
};

struct Incoming {
  unsigned rank;
  int tag;
  void* data;
  std::size_t num_bytes;
};

// Any number of bytes from a rank.
struct Letter {
  unsigned rank;
  std::vector<std::byte> bytes;
};

// All ranks call the same functions in the same order, but for letters. Errors end the process.
class Carrier {
 public:
  virtual ~Carrier() = default;

  virtual unsigned rank() const = 0;
  virtual unsigned num_ranks() const = 0;
  // Ranks on this machine, this one included.
  virtual unsigned num_ranks_here() const = 0;
  virtual unsigned rank_here() const = 0;  // among them
  // Number of ranks, with this one, that may run on the same CPUs: launchers bind several to a socket.
  virtual unsigned num_ranks_on_cpus() const = 0;
  // Every rank gets the bytes of rank 0.
  virtual void broadcast(std::vector<std::byte>& bytes) = 0;
  // all: num_bytes of each rank, in order.
  virtual void all_gather(const void* mine, std::size_t num_bytes, void* all) = 0;
  // Sends and receives. Both sides know the sizes.
  virtual void exchange(const std::vector<Outgoing>& out, const std::vector<Incoming>& in) = 0;
  // Letters, for work that ranks do apart. A letter may have to wait until its receiver looks.
  virtual void send(unsigned rank, const std::vector<std::byte>& bytes) = 0;
  virtual std::optional<Letter> try_receive() = 0;  // the next one, if there is any
};

// One process holds all domains.
class LocalCarrier : public Carrier {
 public:
  unsigned rank() const override { return 0; }
  unsigned num_ranks() const override { return 1; }
  unsigned num_ranks_here() const override { return 1; }
  unsigned rank_here() const override { return 0; }
  unsigned num_ranks_on_cpus() const override { return 1; }
  void broadcast(std::vector<std::byte>&) override {}
  void all_gather(const void* mine, std::size_t num_bytes, void* all) override {
    std::memcpy(all, mine, num_bytes);
  }
  void exchange(const std::vector<Outgoing>&, const std::vector<Incoming>&) override {}
  void send(unsigned, const std::vector<std::byte>&) override {}
  std::optional<Letter> try_receive() override { return std::nullopt; }
};

}  // namespace pf
