// axisd-link: takes configured CAN links down and up for axisd, which has no privileges (rule M26). Started
// by systemd when somebody connects to its socket (deploy/axisd-link.socket). It needs CAP_NET_ADMIN and
// nothing else; it neither configures links nor sets one up that somebody else has set down.
#include <fmt/format.h>
#include <getopt.h>
#include <pwd.h>
#include <systemd/sd-daemon.h>

#include <cstdio>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/link/server.hpp"

namespace {

using namespace axisd;

constexpr std::string_view usage =
    "usage: axisd-link [--links FILE] [--user NAME]\n"
    "Takes CAN links down and up when asked over the socket that systemd hands over.\n"
    "  --links FILE  the interfaces that it may touch, one per line (default /etc/axisd/links)\n"
    "  --user NAME   who may ask, besides root (default axisd)\n";

struct Options {
  std::string links = "/etc/axisd/links";
  std::string user = "axisd";
};

/// Nothing: the usage was printed; exit status in `status`.
std::optional<Options> parse(int argc, char** argv, int& status) {
  Options options;
  const option known[] = {{"links", required_argument, nullptr, 'l'},
                          {"user", required_argument, nullptr, 'u'},
                          {"help", no_argument, nullptr, 'h'},
                          {nullptr, 0, nullptr, 0}};
  for (int found = 0; (found = getopt_long(argc, argv, "", known, nullptr)) != -1;) {
    if (found == 'l') options.links = optarg;
    if (found == 'u') options.user = optarg;
    if (found != 'l' && found != 'u') {
      status = found == 'h' ? 0 : 2;
      fmt::print(found == 'h' ? stdout : stderr, "{}", usage);
      return std::nullopt;
    }
  }
  if (optind == argc) return options;
  status = 2;
  fmt::print(stderr, "{}", usage);
  return std::nullopt;
}

int complain(const std::string& what) {
  fmt::print(stderr, "axisd-link: {}\n", what);
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  int status = 0;
  const auto options = parse(argc, argv, status);
  if (!options) return status;
  // Once, here: the daemon's user does not change while this runs.
  const auto* user = getpwnam(options->user.c_str());
  if (user == nullptr) return complain(fmt::format("there is no user {}", options->user));
  if (sd_listen_fds(1) != 1 || sd_is_socket_unix(SD_LISTEN_FDS_START, SOCK_STREAM, 1, nullptr, 0) <= 0)
    return complain("it takes one listening unix socket from systemd (axisd-link.socket)");
  auto netlink = link::Netlink::open();
  if (!netlink) return complain(netlink.error().message);
  link::Server server(FileDescriptor(SD_LISTEN_FDS_START), user->pw_uid,
                      link::Links(std::move(*netlink), options->links));
  for (;;) server.serve_one();
}
