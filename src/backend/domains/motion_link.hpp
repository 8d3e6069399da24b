// A direct way for the motion that ghost parcels follow: from the memory of one GPU into that of another.
// Without one, motion goes through the host's memory and the carrier.
#pragma once

#include <cstdint>
#include <string>

namespace pf {

// The choice of --domain-link.
enum class LinkChoice : std::uint8_t { automatic, host, direct };

class MotionLink {
 public:
  virtual ~MotionLink() = default;

  virtual std::string name() const = 0;  // for the report
  // Between Domain::start() and step_borders(), on all ranks: brings motion of the end of the last step from
  // the domains to all ghosts of their parcels. The GPUs work on meanwhile, and wait for it in
  // step_borders(). Throws DeviceError if another rank does not answer.
  virtual void update_ghosts() = 0;
};

}  // namespace pf
