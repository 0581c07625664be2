// What frames say, in the names of the drives' manuals. Pure.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "axisd/v1/bus_service.pb.h"
#include "axisd/v1/drive_service.pb.h"

namespace axisd::axisctl {

/// Reads frames in the order of the wire: a Modbus reply does not say which registers it has. Thread: one.
class FrameNames {
 public:
  /// What the drive at `node` calls its registers or objects.
  void add(std::uint32_t node, const v1::ListParametersResponse& catalogue);
  /// "read speed", "speed=60", "write controlword=15", "SYNC"; an address where there is no name. Empty: it
  /// says nothing that is known.
  std::string text(const v1::TracedFrame& frame);

 private:
  struct Entry {
    std::string name;
    v1::ParameterType type = v1::PARAMETER_TYPE_UNSPECIFIED;
  };

  [[nodiscard]] std::string name(std::uint32_t node, std::uint32_t address) const;
  /// "speed=-60"; `raw` as it was sent, in so many bytes.
  [[nodiscard]] std::string value(std::uint32_t node, std::uint32_t address, std::uint32_t raw,
                                  unsigned bytes) const;
  [[nodiscard]] std::string registers(std::uint32_t node, std::uint32_t first, std::string_view words) const;
  [[nodiscard]] std::string rtu_request(std::string_view frame) const;
  [[nodiscard]] std::string rtu_reply(std::string_view frame) const;
  [[nodiscard]] std::string sdo(std::uint32_t node, std::string_view data, bool request) const;
  [[nodiscard]] std::string can_text(const v1::TracedFrame& frame) const;

  std::map<std::pair<std::uint32_t, std::uint32_t>, Entry> entries_;  ///< by node and address
  std::map<std::uint32_t, std::uint32_t> asked_;  ///< the first register that a node was asked for
};

}  // namespace axisd::axisctl
