// The SDO server of a simulated node (CiA 301, 7.2.4.3): expedited and segmented transfers, aborts.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "devices/simulation/canopen_objects.hpp"

namespace axisd::simulation {

struct SdoServerSettings {
  bool segmented_uploads = false;  ///< also of what fits into one frame
  bool shorter_writes = false;     ///< fewer bytes than the object has are taken
};

/// One transfer at a time; a new request ends what was under way. Without time: who owns it sends the answer.
class CanopenSdoServer {
 public:
  using Bytes = std::array<std::uint8_t, 8>;
  explicit CanopenSdoServer(SdoServerSettings settings = {}) : settings_(settings) {}

  /// The answer to 8 bytes from the client; nothing for an abort.
  std::optional<Bytes> on_request(std::span<const std::uint8_t, 8> request, CanopenObjects& objects);
  /// Forgets the transfer under way.
  void reset() { transfer_ = Transfer::none; }

 private:
  enum class Transfer : std::uint8_t { none, download, upload };
  Bytes begin_download(std::span<const std::uint8_t, 8> request, CanopenObjects& objects);
  Bytes download_segment(std::span<const std::uint8_t, 8> request, CanopenObjects& objects);
  Bytes begin_upload(CanopenObjects& objects);
  Bytes upload_segment(std::uint8_t command);
  Bytes abort(std::uint32_t code);
  [[nodiscard]] Bytes named(std::uint8_t command) const;

  SdoServerSettings settings_;
  Transfer transfer_ = Transfer::none;
  std::uint16_t index_ = 0;
  std::uint8_t sub_ = 0;
  bool toggle_ = false;
  std::optional<std::uint32_t> announced_;  ///< size of a segmented download
  std::vector<std::uint8_t> data_;
  std::size_t sent_ = 0;
};

}  // namespace axisd::simulation
