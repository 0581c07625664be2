// Whether more than one node answers the SDO requests to a node-ID.
#pragma once

#include <algorithm>

namespace axisd::canopen {

/// Counts replies that no request explains, against answers. The replies of a second node need not follow the
/// first one's at once: it may be slower by many requests, and then send them in one burst. A frame that CAN
/// itself repeats (an error in the last bit but one of its end, ISO 11898-1) is no habit. Pure. Thread: core.
class SurplusReplies {
 public:
  void on_surplus() { count_ = std::min(count_ + 1, most); }
  /// Each so many answers make up for one surplus reply.
  void on_answer() {
    if (++answers_ % forgiving == 0) count_ = std::max(count_ - 1, 0);
  }
  [[nodiscard]] bool habitual() const { return count_ >= often; }

 private:
  static constexpr int often = 3;
  static constexpr int most = 16;  ///< how long it is held against a node-ID that answers once again
  static constexpr unsigned forgiving = 4;
  int count_ = 0;
  unsigned answers_ = 0;
};

}  // namespace axisd::canopen
