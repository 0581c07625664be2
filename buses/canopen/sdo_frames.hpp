// SDO frames, expedited and segmented: pure encoding and checking (CiA 301 7.2.4.3). Block transfer is not
// used: no object of the drives is longer than a few bytes.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <variant>

#include "buses/can/port.hpp"
#include "buses/canopen/object.hpp"

namespace axisd::canopen {

/// Codes that a client itself sends (CiA 301 table 22); the whole list is in sdo_abort.cpp.
enum class SdoAbort : std::uint32_t {
  toggle_not_alternated = 0x05030000,
  timed_out = 0x05040000,
  bad_command = 0x05040001,
  out_of_memory = 0x05040005,
  length_mismatch = 0x06070010,
  general = 0x08000000,
};

/// Data of an SDO frame is always 8 bytes; unused ones are 0.
using SdoData = std::array<std::uint8_t, 8>;

// Requests.
SdoData upload_request(Object object);
/// 1..4 bytes. Without `indicate_size` the server takes as many as its object has.
SdoData expedited_download_request(Object object, std::span<const std::uint8_t> bytes,
                                   bool indicate_size = true);
SdoData segmented_download_request(Object object, std::optional<std::uint32_t> total_size);
SdoData upload_segment_request(bool toggle);
/// Up to 7 bytes; `last`: no segment follows.
SdoData download_segment_request(bool toggle, std::span<const std::uint8_t> bytes, bool last);
SdoData abort_frame(Object object, std::uint32_t code);

// Replies, by meaning.
struct ExpeditedUpload {
  Object object;
  Bytes bytes;          ///< all 4 where the size is not indicated
  bool size_indicated;  ///< the server said how many bytes count
};
struct SegmentedUpload {
  Object object;
  std::optional<std::uint32_t> total_size;  ///< in bytes, where indicated
};
struct UploadSegment {
  bool toggle;
  Bytes bytes;  ///< 0..7
  bool last;
};
struct DownloadAccepted {
  Object object;
};
struct DownloadSegmentAccepted {
  bool toggle;
};
struct Aborted {
  Object object;
  std::uint32_t code;
};
/// Not a reply that a client of these services can get (too short, unknown command, block transfer).
struct NotAReply {};
using SdoReply = std::variant<NotAReply, ExpeditedUpload, SegmentedUpload, UploadSegment, DownloadAccepted,
                              DownloadSegmentAccepted, Aborted>;
SdoReply parse_sdo_reply(const can::Frame& frame);

}  // namespace axisd::canopen
