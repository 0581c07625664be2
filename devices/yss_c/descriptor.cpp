// Makes the YSS-C one of the models: CMake finds them by this file's name.
#include "devices/yss_c/model.hpp"

namespace axisd::yss_c {

std::span<const DriveDescriptor> descriptors();

std::span<const DriveDescriptor> descriptors() { return {&descriptor(), 1}; }

}  // namespace axisd::yss_c
