// One SDO transfer from its first frame to its last, as a machine without I/O and time (CiA 301 7.2.4.3).
#pragma once

#include <optional>

#include "buses/canopen/sdo_frames.hpp"
#include "buses/error.hpp"

namespace axisd::canopen {

/// Client side of one upload or download.
///
///   upload:   opening --expedited--> done     opening --segmented--> segments --last--> done
///   download: opening --accepted, up to 4 bytes--> done
///             opening --accepted--> segments --last accepted--> done
///   any phase: abort, wrong toggle bit, too much data -> failed
class SdoTransfer {
 public:
  /// Reads `object`; more than `limit` bytes are an error.
  static SdoTransfer upload(Object object, std::size_t limit);
  /// Writes `bytes` (at least one; up to 4 go expedited) to `object`.
  static SdoTransfer download(Object object, Bytes bytes);

  struct Step {
    enum class Kind : std::uint8_t {
      ignored,  ///< not an answer to what was asked last
      send,     ///< `frame` continues the transfer
      done,
      failed,  ///< `error`; `frame`, if any, is an abort that the server is owed
    };
    Kind kind = Kind::ignored;
    std::optional<SdoData> frame{};
    Error error{};
  };

  SdoData first_frame();
  Step on_reply(const SdoReply& reply);
  /// Tells the server that nobody waits any more.
  [[nodiscard]] SdoData abort(SdoAbort code) const;

  [[nodiscard]] Object object() const { return object_; }
  [[nodiscard]] bool is_download() const { return download_; }
  /// The server has all data of a download, though it did not confirm it: the write may have had its effect.
  [[nodiscard]] bool complete_at_server() const { return download_ && all_sent_; }
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }
  [[nodiscard]] bool size_indicated() const { return size_indicated_; }

 private:
  enum class Phase : std::uint8_t { opening, segments };
  SdoTransfer(Object object, bool download, Bytes bytes, std::size_t limit)
      : object_(object), download_(download), bytes_(std::move(bytes)), limit_(limit) {}

  Step on_aborted(const Aborted& aborted) const;
  Step on_opened(const ExpeditedUpload& reply);
  Step on_opened(const SegmentedUpload& reply);
  Step on_accepted();
  Step on_segment(const UploadSegment& reply);
  Step on_segment_accepted(const DownloadSegmentAccepted& reply);
  SdoData next_download_segment();
  [[nodiscard]] Step broken(SdoAbort code, std::string what) const;
  [[nodiscard]] Step too_long(std::uint64_t size) const;

  Object object_;
  bool download_;
  Bytes bytes_;
  std::size_t limit_;
  Phase phase_ = Phase::opening;
  bool toggle_ = false;  ///< of the segment that is under way
  std::size_t sent_ = 0;
  bool all_sent_ = false;
  bool size_indicated_ = false;
  std::optional<std::uint32_t> total_size_;
};

}  // namespace axisd::canopen
