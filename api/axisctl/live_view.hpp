// Text that changes in place.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace axisd::axisctl {

/// Lines at the end of the terminal, redrawn in place. While it lives, the cursor is hidden.
class LiveView {
 public:
  LiveView();
  LiveView(const LiveView&) = delete;
  LiveView& operator=(const LiveView&) = delete;
  ~LiveView();

  /// In place of what was shown before; no more lines than the terminal has.
  void show(std::vector<std::string> lines);

 private:
  std::size_t drawn_ = 0;
};

}  // namespace axisd::axisctl
