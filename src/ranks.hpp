// The processes that this run consists of: one, or those that a launcher of MPI started.
#pragma once

#include <functional>
#include <memory>

#include "backend/domains/carrier.hpp"
#include "backend/domains/domain_backend.hpp"

namespace pf {

class Ranks {
 public:
  // Joins the processes of the launcher, if one started this process. Throws UserError if that is not
  // possible; in the first process also if they differ in version or arguments.
  Ranks(int argc, const char* const* argv);
  // Lets the others end.
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  unsigned num() const { return carrier_->num_ranks(); }
  // True for the one that reads the command line and shows what flies. The others only serve.
  bool leads() const { return carrier_->rank() == 0; }
  const std::shared_ptr<Carrier>& carrier() const { return carrier_; }
  // Serves the first rank until it ends. other_work: called when it asks for that. find_gpus: called if it
  // works on GPUs; may return null. Prints errors, which end all ranks.
  int serve(const std::function<void()>& other_work, const FindDomainGpus& find_gpus);
  // After an error that left the others waiting. Returns the exit code if there are none.
  int fail(int exit_code) const;

 private:
  std::shared_ptr<Carrier> carrier_;
  bool are_alike_ = true;  // in version and arguments
};

}  // namespace pf
