// A serial CAN adapter (slcan) on a pseudo terminal: the kernel makes a genuine CAN interface of it.
#pragma once

#include <atomic>
#include <mutex>
#include <string>
#include <thread>

namespace axisd::can::test {

class SlcanAdapter {
 public:
  /// Creates the interface, down, with a queue of 10 frames and no restart by itself. bitrate 0: none.
  explicit SlcanAdapter(std::uint32_t bitrate = 0);
  ~SlcanAdapter();
  SlcanAdapter(const SlcanAdapter&) = delete;

  [[nodiscard]] const std::string& interface() const { return interface_; }
  /// A stalled one reads nothing: the kernel's queue fills.
  void set_stalled(bool stalled) { stalled_ = stalled; }
  /// Says `text` to the kernel: "sb000256\r" is bus-off.
  void say(const std::string& text);
  /// Data frames that the adapter was given since the last call, without their data: "t100 t101".
  std::string taken();

 private:
  void read_on();

  int master_ = -1, slave_ = -1;
  std::string interface_;
  std::atomic<bool> stalled_{false}, ended_{false};
  std::mutex mutex_;
  std::string text_;
  std::thread reader_;
};

}  // namespace axisd::can::test
