// A full RS-485 line in virtual time: axes that index, each as soon as its last move is done. README.md says
// what is measured. Ends with 1 where a command failed, or a published bound or a share was missed.
//   bench_index PART [--moves N] [--stops N] [--rounds N] [--pause MS] [--axes N ...] [--baud BAUD ...]
//   [--drive KEY=VALUE]
//     rates     moves per second, beside those of a raw script on the same line; shares; waits
//     stops     stops on that line, beside those on a line that is full of readings
//     done      from a drive's standstill to the end of its command; --pause: that clients take between two
//               moves
//     groups    start skew of 2 to 16 members, while all others of 16 axes index
// --drive: a key of `drive:` of each axis; true and false are no text.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <charconv>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "tests/bench/index_virtual.hpp"

namespace {

using namespace axisd;
using namespace axisd::bench;

long number(std::string_view text) {
  long value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value <= 0)
    throw std::runtime_error(fmt::format("\"{}\" is no number above 0", text));
  return value;
}

void read_option(Given& given, const std::string& option, const std::vector<std::string>& values) {
  std::vector<int> all;
  if (option == "--drive") {
    for (const auto& value : values) {
      const auto equals = value.find('=');
      if (equals == std::string::npos) throw std::runtime_error("--drive takes KEY=VALUE");
      const auto text = value.substr(equals + 1);
      given.drive[value.substr(0, equals)] =
          text == "true" || text == "false" ? SettingValue(text == "true") : SettingValue(text);
    }
    return;
  }
  for (const auto& value : values) all.push_back(static_cast<int>(number(value)));
  if (option == "--axes")
    given.axes = all;
  else if (option == "--baud")
    given.bauds = all;
  else if (given.numbers.contains(option) && all.size() == 1)
    given.numbers[option] = all.front();
  else
    throw std::runtime_error("unknown option, or a value is missing: " + option);
}

Given read(const std::vector<std::string>& words) {
  Given given;
  for (std::size_t i = 1; i < words.size();) {
    const auto option = words[i++];
    std::vector<std::string> values;
    while (i < words.size() && !words[i].starts_with("--")) values.push_back(words[i++]);
    read_option(given, option, values);
  }
  return given;
}

}  // namespace

int main(int argc, char** argv) try {
  spdlog::set_level(spdlog::level::warn);
  const std::vector<std::string> words(argv + 1, argv + argc);
  const std::map<std::string, bool (*)(const Given&)> parts{
      {"rates", rates}, {"stops", stops}, {"done", done}, {"groups", groups}};
  const auto part = words.empty() ? parts.end() : parts.find(words.front());
  if (part == parts.end()) {
    fmt::print(stderr,
               "usage: bench_index rates|stops|done|groups [OPTIONS], as at the head of its source\n");
    return 2;
  }
  const bool good = part->second(read(words));
  return good && !testing::UnitTest::GetInstance()->Failed() ? 0 : 1;
} catch (const std::exception& error) {
  fmt::print(stderr, "bench_index: {}\n", error.what());
  return 1;
}
