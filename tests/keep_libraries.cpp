// In every program that is built with AddressSanitizer, instead of the system's dlclose: libraries stay until the process ends. The Vulkan
// loader unloads drivers, and what a driver keeps for its own end then looks leaked by nobody, which no suppression can name.

extern "C" __attribute__((visibility("default"))) int dlclose(void* /*library*/) noexcept;  // for all, the loader too
extern "C" int dlclose(void* /*library*/) noexcept { return 0; }
