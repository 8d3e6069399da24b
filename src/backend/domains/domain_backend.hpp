// The domains as one backend. It lives on rank 0 and tells the other ranks what to do (serve_domains).
#pragma once

#include <exception>
#include <memory>

#include "backend/backend.hpp"
#include "backend/domains/carrier.hpp"
#include "backend/domains/domain.hpp"

namespace pf {

// The first of several ranks has failed where the others wait for it, so that none can go on. Not a
// std::exception, since whoever handles a lesser failure, as of a picture, must not go on with the run.
struct BrokenRanks {
  std::exception_ptr cause;
};

// num_domains: a multiple of the number of ranks. num_threads: of each rank; 0 means all of the machine,
// shared by its ranks. gpus: those of this rank, and the others then use theirs; null for processors. link:
// between GPUs; throws UserError if it cannot be had. At a time only one such backend works: another one
// takes the ranks over. Its functions throw BrokenRanks, after which only the end of all ranks is left.
std::unique_ptr<Backend> make_domain_backend(std::shared_ptr<Carrier> carrier, unsigned num_domains,
                                             unsigned num_threads, std::shared_ptr<DomainGpus> gpus = nullptr,
                                             LinkChoice link = LinkChoice::automatic);

// Why several domains cannot fly a method, with a remedy; "": they can.
std::string refusal_in_domains(Method method);

// The GPUs of this rank, or null.
using FindDomainGpus = std::function<std::shared_ptr<DomainGpus>()>;

enum class Served { ended, asked_to_leave };
// On every rank but the first: does what rank 0 orders until end_domains() or leave_domains(). find_gpus:
// called when rank 0 works on GPUs. Throws DeviceError if this rank has none then.
Served serve_domains(Carrier& carrier, const FindDomainGpus& find_gpus = {});

// On rank 0.
void end_domains(Carrier& carrier);
void leave_domains(Carrier& carrier);

}  // namespace pf
