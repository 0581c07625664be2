// The files of axisd-web: its configuration and its users.
#include <algorithm>

#include "api/transport/address.hpp"
#include "api/web/gateway/settings.hpp"
#include "api/web/gateway/users.hpp"
#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {
namespace {

void users(std::string_view file) {
  const auto read = web::parse_users(file, "users");
  if (!read) {
    expect(read.error().message.starts_with("users"), "an error names the file");
    expect(read.error().message.find('\n') == std::string::npos, "an error is one line");
    return;
  }
  expect(std::ranges::all_of(
             *read, [](const auto& user) { return web::is_user_name(user.name) && web::is_role(user.role); }),
         "whoever is in it has a name and a role");
  const auto again = web::parse_users(web::to_text(*read), "users");
  expect(again && *again == *read, "what is read survives being written");
}

void settings(std::string_view file) {
  const auto loaded = web::read_settings(file, "web.yaml");
  expect(loaded.settings.has_value() == loaded.diagnostics.empty(),
         "a file is served, or it is told why not");
  if (loaded.settings)
    expect(transport::host_and_port(loaded.settings->listen).has_value(), "it listens somewhere");
}

}  // namespace

void run(Input input) {
  const bool of_users = input.byte() % 2 == 0;
  const auto file = text(input.rest());
  if (of_users)
    users(file);
  else
    settings(file);
  if (const auto address = transport::host_and_port(file))
    expect(!address->host.empty() && !address->port.empty(), "an address has both");
}

}  // namespace axisd::fuzz
