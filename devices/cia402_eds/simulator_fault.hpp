// The error code that the simulated standard drive shows.
#pragma once

namespace axisd::cia402_eds {

class Fault {
 public:
  /// Of the fault that it is in; 0: none.
  [[nodiscard]] int code() const { return code_; }
  /// 603Fh.
  [[nodiscard]] int told() const { return told_; }
  void raise(int code) { code_ = told_ = code; }
  /// `still_told`: 603Fh keeps it.
  void reset(bool still_told) {
    code_ = 0;
    if (!still_told) told_ = 0;
  }

 private:
  int code_ = 0, told_ = 0;
};

}  // namespace axisd::cia402_eds
