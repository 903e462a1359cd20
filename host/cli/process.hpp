// What a command that runs once asks of its process.
#pragma once

namespace swarmfit::cli {

/// Memory that was freed is kept for the next large array instead of going back to the system page by page; and OpenBLAS, which OpenCV brings
/// along on some systems, lets go of its workers, which else spin on the processors for the first tens of milliseconds. It starts them again if
/// it needs them. Where either is not there nothing happens.
void settle_process();

}  // namespace swarmfit::cli
