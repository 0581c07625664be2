// The parts of bench_index: axes of an RS-485 line that index, in virtual time. Each prints, and is false
// where a command failed, or a published bound or a share was missed.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "devices/axis/settings.hpp"

namespace axisd::bench {

struct Given {
  std::map<std::string, long, std::less<>> numbers{
      {"--moves", 2000}, {"--stops", 300}, {"--rounds", 5}, {"--pause", 0}};
  std::vector<int> axes;
  std::vector<int> bauds{115200, 19200};
  std::map<std::string, SettingValue> drive;
};

/// Moves per second, beside those of a raw script on the same line; shares; waits.
bool rates(const Given& given);
/// Stops on that line, beside those on a line that is full of readings.
bool stops(const Given& given);
/// From a drive's standstill to the end of its command.
bool done(const Given& given);
/// Start skew of 2 to 16 members, while all others of 16 axes index.
bool groups(const Given& given);

}  // namespace axisd::bench
