#include "daemon/link/request.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "buses/file_descriptor.hpp"

namespace axisd::link {
namespace {

constexpr std::size_t longest_name = 15;  // IFNAMSIZ less the end
constexpr std::size_t longest_file = 4096;

/// What the kernel takes, and nothing that could be mistaken in a log.
bool is_name(std::string_view text) {
  constexpr std::string_view marks = "-_.";
  return !text.empty() && text.size() <= longest_name && text != "." && text != ".." &&
         std::ranges::all_of(text, [&](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                  marks.contains(c);
         });
}

Result<std::string> contents(const std::string& path) {
  const auto failure = [&](int why) {
    return fail(Reason::misconfigured, fmt::format("{}: {}", path, std::strerror(why)),
                "write the interfaces that may be cycled into it, one per line");
  };
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0) return failure(errno);
  struct stat status{};
  if (::fstat(file.get(), &status) != 0) return failure(errno);
  const bool ours = status.st_uid == 0 || status.st_uid == ::geteuid();
  if (!S_ISREG(status.st_mode) || !ours || (status.st_mode & (S_IWGRP | S_IWOTH)) != 0)
    return fail(Reason::misconfigured, fmt::format("{}: others than root can write it", path),
                "chown root it and chmod 644 it");
  std::array<char, longest_file> buffer;
  const auto length = ::read(file.get(), buffer.data(), buffer.size());
  if (length < 0) return failure(errno);
  if (static_cast<std::size_t>(length) == buffer.size()) return failure(EFBIG);
  return std::string(buffer.data(), static_cast<std::size_t>(length));
}

std::vector<std::string_view> words_of(std::string_view line) {
  constexpr std::string_view blanks = " \t\r";
  std::vector<std::string_view> words;
  for (auto begin = line.find_first_not_of(blanks); begin != std::string_view::npos;
       begin = line.find_first_not_of(blanks)) {
    line.remove_prefix(begin);
    const auto end = std::min(line.find_first_of(blanks), line.size());
    words.push_back(line.substr(0, end));
    line.remove_prefix(end);
  }
  return words;
}

}  // namespace

Result<Request> parse_request(std::string_view line) {
  const auto words = words_of(line);
  if (words.size() == 2 && is_name(words[1])) {
    if (words[0] == "check") return Request{.verb = Verb::check, .interface = std::string(words[1])};
    if (words[0] == "cycle") return Request{.verb = Verb::cycle, .interface = std::string(words[1])};
  }
  return fail(Reason::invalid_argument, "this is no request", "say: cycle INTERFACE, or check INTERFACE");
}

Result<std::vector<std::string>> parse_links(std::string_view text) {
  std::vector<std::string> links;
  while (!text.empty()) {
    const auto end = std::min(text.find('\n'), text.size());
    const auto line = text.substr(0, end);
    for (const auto word : words_of(line.substr(0, std::min(line.find('#'), line.size())))) {
      if (!is_name(word))
        return fail(Reason::misconfigured, fmt::format("\"{}\" is no name of an interface", word),
                    "give names as ip link shows them");
      links.emplace_back(word);
    }
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return links;
}

Result<std::vector<std::string>> read_links(const std::string& path) {
  const auto text = contents(path);
  if (!text) return fail(text.error());
  auto links = parse_links(*text);
  if (!links) links.error().message = fmt::format("{}: {}", path, links.error().message);
  return links;
}

Result<void> permitted(const std::string& interface, const std::vector<std::string>& links,
                       const std::string& path) {
  if (std::ranges::find(links, interface) != links.end()) return {};
  return fail(Reason::misconfigured, fmt::format("{} is not among the links of {}", interface, path),
              fmt::format("add {} to it", interface));
}

}  // namespace axisd::link
