// Independent pieces of work on the threads of the machine, one thread each: small runs gain more from that
// than from sharing the steps of each among all threads.
#pragma once

#include <functional>

namespace pf {

// Calls work(k) once for each k in [0, num), num >= 0, in any order, on num_threads threads (0: all that the
// machine has; 1: on this one, in order). When a call throws, no further one begins, and the exception leaves
// here after those under way have ended.
void parallel_for(int num, unsigned num_threads, const std::function<void(int)>& work);

}  // namespace pf
