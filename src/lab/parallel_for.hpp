// Independent pieces of work on the threads of the machine, one thread each. Small runs gain more from this
// than from sharing each step among all threads.
#pragma once

#include <functional>

namespace pf {

// Limits all later calls of this process to so many threads; 0: one per core.
void limit_parallel_threads(unsigned num_threads);

// Number of threads that calls without one of their own use.
unsigned parallel_threads();

// Calls work(k) once for each k in [0, num), num >= 0, in any order, on num_threads threads (0: as many as
// the limit allows; 1: on the calling thread, in order). After a call throws, no further call starts; the
// exception is rethrown when the running calls have ended.
void parallel_for(int num, unsigned num_threads, const std::function<void(int)>& work);

}  // namespace pf
