// What a command that runs once asks of its process.
#pragma once

#include <cstddef>
#include <exception>
#include <string>

#include <swarmfit/error.hpp>

namespace swarmfit::cli {

/// No file takes the place of a standard stream that is closed. Memory that was freed is kept for the next large array instead of going
/// back to the system page by page, and comes in large pages where the system gives them on request. OpenBLAS, which OpenCV brings along on
/// some systems, lets go of its workers, which else spin on the processors for the first tens of milliseconds; it starts them again if it
/// needs them. Where any of this is not there nothing happens.
void settle_process();

/// Once an input is loaded. Where its points take so many bytes that memory counts for more than the faults of its pages, what reading them
/// took goes back to the system, and so do arrays of that size from now on when they are freed: on the heap, what is left between them
/// would not fit the next.
void settle_large_input(std::size_t bytes);

/// What an exception that nobody else caught says to whoever runs the command.
Error error_of(const std::exception& thrown);

/// The command line, for what is written to say how to have it again.
void remember_command(int argc, const char* const* argv);
/// As a shell takes it, the program by its name alone; empty where none was remembered.
const std::string& remembered_command();

}  // namespace swarmfit::cli
