// Ranks that are threads of one process, for tests: what MPI does, without it.
#pragma once

#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <tuple>
#include <vector>

#include "backend/domains/domain_backend.hpp"

namespace pf::test {

// Messages on their way, by sender, receiver and tag.
class Mail {
 public:
  using Bytes = std::vector<std::byte>;

  void send(unsigned from, unsigned to, int tag, Bytes bytes) {
    const std::lock_guard lock(mutex_);
    boxes_[{from, to, tag}].push_back(std::move(bytes));
    arrived_.notify_all();
  }
  Bytes receive(unsigned from, unsigned to, int tag) {
    std::unique_lock lock(mutex_);
    std::deque<Bytes>& box = boxes_[{from, to, tag}];
    arrived_.wait(lock, [&] { return !box.empty(); });
    Bytes bytes = std::move(box.front());
    box.pop_front();
    return bytes;
  }

  void post(unsigned to, Letter letter) {
    const std::lock_guard lock(mutex_);
    letters_[to].push_back(std::move(letter));
  }
  std::optional<Letter> look(unsigned to) {
    const std::lock_guard lock(mutex_);
    if (letters_[to].empty()) return std::nullopt;
    Letter letter = std::move(letters_[to].front());
    letters_[to].pop_front();
    return letter;
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::map<std::tuple<unsigned, unsigned, int>, std::deque<Bytes>> boxes_;
  std::map<unsigned, std::deque<Letter>> letters_;  // by receiver
};

class ThreadCarrier final : public Carrier {
 public:
  ThreadCarrier(std::shared_ptr<Mail> mail, unsigned rank, unsigned num_ranks)
      : mail_(std::move(mail)), rank_(rank), num_ranks_(num_ranks) {}

  unsigned rank() const override { return rank_; }
  unsigned num_ranks() const override { return num_ranks_; }
  unsigned num_ranks_here() const override { return num_ranks_; }
  unsigned num_ranks_on_cpus() const override { return num_ranks_; }
  unsigned rank_here() const override { return rank_; }
  void broadcast(std::vector<std::byte>& bytes) override {
    if (rank_ != 0) {
      bytes = mail_->receive(0, rank_, kBroadcast);
      return;
    }
    for (unsigned to = 1; to < num_ranks_; ++to) mail_->send(0, to, kBroadcast, bytes);
  }
  void all_gather(const void* mine, std::size_t num_bytes, void* all) override {
    const auto* first = static_cast<const std::byte*>(mine);
    for (unsigned to = 0; to < num_ranks_; ++to) mail_->send(rank_, to, kGather, {first, first + num_bytes});
    for (unsigned from = 0; from < num_ranks_; ++from) {
      const Mail::Bytes bytes = mail_->receive(from, rank_, kGather);
      std::memcpy(static_cast<std::byte*>(all) + from * num_bytes, bytes.data(), num_bytes);
    }
  }
  void exchange(const std::vector<Outgoing>& out, const std::vector<Incoming>& in) override {
    for (const Outgoing& message : out) {
      const auto* first = static_cast<const std::byte*>(message.data);
      mail_->send(rank_, message.rank, message.tag, {first, first + message.num_bytes});
    }
    for (const Incoming& message : in) {
      const Mail::Bytes bytes = mail_->receive(message.rank, rank_, message.tag);
      if (bytes.size() != message.num_bytes) std::terminate();
      std::memcpy(message.data, bytes.data(), bytes.size());
    }
  }

  void send(unsigned to, const std::vector<std::byte>& bytes) override { mail_->post(to, {rank_, bytes}); }
  std::optional<Letter> try_receive() override { return mail_->look(rank_); }

 private:
  static constexpr int kBroadcast = -1, kGather = -2;

  std::shared_ptr<Mail> mail_;
  unsigned rank_, num_ranks_;
};

// The tests of domains are built twice: gpu_tests has their domains on GPUs (gpu/domain_gpus.cpp).
bool are_domains_on_gpus();
// Null for processors, or without a GPU.
std::shared_ptr<DomainGpus> domain_gpus();

// Ranks 1 to num_ranks - 1 serve until the end of this object. Its backends must end before it.
class ThreadRanks {
 public:
  explicit ThreadRanks(unsigned num_ranks) {
    const auto mail = std::make_shared<Mail>();
    first_ = std::make_shared<ThreadCarrier>(mail, 0, num_ranks);
    for (unsigned rank = 1; rank < num_ranks; ++rank) {
      others_.emplace_back([=] {
        ThreadCarrier carrier(mail, rank, num_ranks);
        serve_domains(carrier, domain_gpus);
      });
    }
  }
  ThreadRanks(const ThreadRanks&) = delete;
  ThreadRanks& operator=(const ThreadRanks&) = delete;
  ~ThreadRanks() { end_domains(*first_); }

  std::unique_ptr<Backend> make_backend(unsigned num_domains, LinkChoice link = LinkChoice::automatic) {
    return make_domain_backend(first_, num_domains, 1, domain_gpus(), link);
  }

 private:
  std::shared_ptr<Carrier> first_;
  std::vector<std::jthread> others_;
};

}  // namespace pf::test
