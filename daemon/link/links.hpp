// Takes CAN links down and up.
#pragma once

#include <set>
#include <string>

#include "daemon/link/netlink.hpp"
#include "daemon/link/request.hpp"

namespace axisd::link {

class Links {
 public:
  /// `file`: read for each request, so that a change of it counts at once.
  Links(Netlink netlink, std::string file) : netlink_(std::move(netlink)), file_(std::move(file)) {}

  /// Errors: not permitted; no CAN interface; it was down already, by somebody else's will; the kernel
  /// refused it.
  Result<void> serve(const Request& request);

  /// Some link that was taken down here could not be set up again: retry() is to be called now and then.
  [[nodiscard]] bool owes() const { return !owed_.empty(); }
  void retry();

 private:
  Result<void> cycle(const std::string& interface);
  Result<void> set_up_again(const can::LinkReport& link);

  Netlink netlink_;
  std::string file_;
  std::set<std::string> owed_;  ///< taken down and not up again
};

}  // namespace axisd::link
