// Marks what a shared library exports.
#pragma once

#if defined(__GNUC__)
#define SWARMFIT_API __attribute__((visibility("default")))
#else
#define SWARMFIT_API
#endif
