// How a terminal is set, as the kernel says it.
#pragma once

#include <gtest/gtest.h>
#include <sys/ioctl.h>

#include <cstdint>

namespace axisd::modbus_rtu::test {

/// The kernel's termios2, which cannot be included beside <termios.h>; glibc's has no speed beyond its list.
struct KernelTermios {
  std::uint32_t flags[4];
  std::uint8_t discipline;
  std::uint8_t characters[19];
  std::uint32_t input_speed, output_speed;
};

inline int speed_of(int descriptor) {
  KernelTermios settings{};
  EXPECT_EQ(ioctl(descriptor, _IOR('T', 0x2A, KernelTermios), &settings), 0);
  EXPECT_EQ(settings.input_speed, settings.output_speed);
  return static_cast<int>(settings.output_speed);
}

}  // namespace axisd::modbus_rtu::test
