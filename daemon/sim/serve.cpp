#include "daemon/sim/serve.hpp"

#include <cerrno>
#include <cstring>

namespace axisd::sim {

int complain(const Error& error) {
  fmt::print(stderr, "axisd-sim: {}{}{}\n", error.message, error.remedy.empty() ? "" : "; ", error.remedy);
  return 2;
}

void say_ready(const std::string& where) {
  fmt::print("ready {}\n", where);
  std::fflush(stdout);
}

Result<FrameLog> FrameLog::open(const std::string& path) {
  FrameLog log;
  if (path.empty()) return log;
  log.file_.reset(std::fopen(path.c_str(), "we"));
  if (!log)
    return fail(Reason::invalid_argument, fmt::format("{}: {}", path, std::strerror(errno)),
                "choose another --log");
  std::setvbuf(log.file_.get(), nullptr, _IOLBF, 4096);
  return log;
}

}  // namespace axisd::sim
