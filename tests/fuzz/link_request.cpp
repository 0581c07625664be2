// What axisd-link, which may take interfaces down, is asked, and its file of those that it may.
#include <algorithm>
#include <string>

#include "daemon/link/request.hpp"
#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {
namespace {

void expect_name(const std::string& interface) {
  constexpr std::size_t longest = 15;  // IFNAMSIZ less its end
  expect(!interface.empty() && interface.size() <= longest && interface != "." && interface != "..",
         "an interface has a name that the kernel takes");
  expect(std::ranges::none_of(interface, [](char c) { return c <= ' ' || c > '~' || c == '/'; }),
         "a name has no blanks and leads nowhere");
}

}  // namespace

void run(Input input) {
  const auto bytes = text(input.rest());
  if (const auto request = link::parse_request(bytes)) expect_name(request->interface);
  if (const auto links = link::parse_links(bytes)) std::ranges::for_each(*links, expect_name);
}

}  // namespace axisd::fuzz
