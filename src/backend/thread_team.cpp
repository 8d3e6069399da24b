#include "backend/thread_team.hpp"

namespace pf {

ThreadTeam::ThreadTeam(unsigned num_threads)
    : num_threads_(num_threads), start_(num_threads), done_(num_threads) {
  for (unsigned thread = 1; thread < num_threads; ++thread) {
    threads_.emplace_back([this, thread] { serve(thread); });
  }
}

ThreadTeam::~ThreadTeam() {
  stopping_ = true;
  start_.arrive_and_wait();
}

void ThreadTeam::run(const std::function<void(unsigned)>& work) {
  if (num_threads_ == 1) return work(0);
  work_ = &work;
  start_.arrive_and_wait();
  work(0);
  done_.arrive_and_wait();
}

void ThreadTeam::serve(unsigned thread) {
  while (true) {
    start_.arrive_and_wait();
    if (stopping_) return;
    (*work_)(thread);
    done_.arrive_and_wait();
  }
}

}  // namespace pf
