#include "api/tls/time_text.hpp"

#include <array>
#include <chrono>
#include <ctime>

namespace axisd::tls {

std::string to_text(WallTime time) {
  const auto seconds = std::chrono::system_clock::to_time_t(time);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  std::array<char, 32> text{};
  return {text.data(), std::strftime(text.data(), text.size(), "%FT%TZ", &parts)};
}

}  // namespace axisd::tls
