#include "devices/simulation/pty_serial.hpp"

#include <asm/termbits.h>  // termios2 and BOTHER; clashes with <termios.h>
#include <sys/ioctl.h>

namespace axisd::simulation {

bool set_pty_serial(int master, const Serial& serial) {
  termios2 settings{};
  settings.c_cflag = BOTHER | CS8 | CREAD | (serial.format.stop_bits == 2 ? CSTOPB : 0U);
  settings.c_cc[VMIN] = 1;
  settings.c_ispeed = settings.c_ospeed = static_cast<speed_t>(serial.baud);
  // The driver applies it to the other end: a master has no settings of its own.
  return ioctl(master, TCSETS2, &settings) == 0;
}

std::optional<Serial> pty_serial(int master, const Serial& configured) {
  termios2 settings{};
  if (ioctl(master, TCGETS2, &settings) != 0) return std::nullopt;
  auto serial = configured;
  serial.parity_hidden = true;
  serial.format.stop_bits = (settings.c_cflag & CSTOPB) != 0 ? 2 : 1;
  // B0, hang up, is no rate.
  if (settings.c_ospeed != 0) serial.baud = static_cast<int>(settings.c_ospeed);
  return serial;
}

}  // namespace axisd::simulation
