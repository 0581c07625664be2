// Who holds an axis in Stopping, and which of these holds a release is about.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>

#include "axisd/v1/types.pb.h"

namespace axisd::axisctl {

/// "hmi-1 (request r7) since 2026-11-24T03:40:02Z", with "not durable" where it ends with the daemon.
std::string text_of(const v1::StopHold& hold);
/// All of them, with commas between.
std::string text_of(const google::protobuf::RepeatedPtrField<v1::StopHold>& holds);
/// What a release left: "released; ..." or "still held by ...".
std::string released_line(const std::string& axis,
                          const google::protobuf::RepeatedPtrField<v1::StopHold>& holds);

/// What release-stop and group release-stop have in common.
struct ReleaseArguments {
  std::string request_id;
  bool mine = false, everybody = false;
  std::uint64_t lease_token = 0;

  void add_to(CLI::App& command);
  void fill(auto& request) const {
    request.set_request_id(request_id);
    request.set_mine(mine);
    request.set_everybody(everybody);
    request.set_lease_token(lease_token);
  }
};

/// Option of a stop with --hold: the name by which it is released.
void add_hold_id(CLI::App& command, std::string& request_id);

}  // namespace axisd::axisctl
