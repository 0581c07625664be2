// HTTP/2 as anybody may speak it to the stop lane, in pieces of any size and at any pace.
#include <string>

#include "api/server/lane/http2.hpp"
#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {

void run(Input input) {
  using server::lane::Http2;
  Http2* lane = nullptr;
  TimePoint now{};
  bool late = false;
  std::int32_t waits = 0;
  Http2 http(
      [&](Http2::Call call) {
        expect(call.message.size() <= Http2::largest_message, "a message is bounded");
        if (late)
          waits = call.stream;
        else
          lane->answer(call.stream, {.code = 3, .error = call.path, .message = {}});
      },
      now);
  lane = &http;
  constexpr std::string_view preface = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
  bool open = input.byte() % 8 == 0 || http.receive(preface, now);
  while (open && !input.empty()) {
    const auto pace = input.byte();
    late = (pace & 1U) != 0;
    now += std::chrono::milliseconds(pace & 0x3EU);
    const auto piece = input.take(1U + (input.byte() | (pace & 0xC0U) << 2U));
    open = http.receive(text(piece), now);
    if (waits != 0 && !late) http.answer(std::exchange(waits, 0), {.message = "late"});
    expect(http.waiting() <= Http2::most_streams, "so many calls wait at most");
    while (!http.take_output(64).empty()) continue;
  }
  if (open) http.go_away();
  (void)http.take_output();
}

}  // namespace axisd::fuzz
