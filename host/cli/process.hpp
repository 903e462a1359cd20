// What a command that runs once asks of its process.
#pragma once

#include <string>

namespace swarmfit::cli {

/// Memory that was freed is kept for the next large array instead of going back to the system page by page, and comes in large pages where the
/// system gives them on request; and OpenBLAS, which OpenCV brings
/// along on some systems, lets go of its workers, which else spin on the processors for the first tens of milliseconds. It starts them again if
/// it needs them. Where either is not there nothing happens.
void settle_process();

/// The command line, for what is written to say how to have it again.
void remember_command(int argc, const char* const* argv);
/// As a shell takes it, the program by its name alone; empty where none was remembered.
const std::string& remembered_command();

}  // namespace swarmfit::cli
