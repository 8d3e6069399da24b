// The program as a process: its signals and its standard streams.
#pragma once

#include <string>
#include <system_error>

namespace pf {

// Writes a line to standard error. Does nothing where that cannot be written: the run and its files go on.
void announce(const std::string& line);

// Message to the user for a failed system call, with a remedy if there is one.
std::string text_of(const std::system_error& error);

// Opens missing standard streams, so that no file opened later takes their place.
void reserve_standard_streams();

// Lets a command finish its files on SIGINT, SIGTERM and SIGHUP, as soon as the frame in hand is ready. A
// second signal ends the program at once. A program that nohup has started ignores SIGHUP.
void stop_gracefully();

// Files and pipes that can no longer be written give errors, with messages, instead of ending the program.
void expect_failing_writes();

// The exit code of the program: 1 instead of 0 if its standard output is lost.
int after_output(int exit_code);

}  // namespace pf
