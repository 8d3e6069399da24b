// Options for files of states: --dump, --checkpoint, --from.
#pragma once

#include "app/option_flags.hpp"
#include "app/options.hpp"

namespace pf {

inline const std::vector<std::string> kDumpFields = {"position", "velocity", "state"};

void add_data_flags(CLI::App& app, Typed& typed);

// Checks them and fills options.data; after options.settings are read. Throws UserError.
void read_data_options(const CLI::App& command, const Typed& typed, Options& options);

}  // namespace pf
