// A node that answers an SDO transfer as it likes, frame by frame.
#include "buses/canopen/sdo_transfer.hpp"

#include <algorithm>

#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {

void run(Input input) {
  using canopen::SdoTransfer;
  constexpr std::uint32_t replies = 0x581;
  const auto kind = input.byte();
  const canopen::Object object{.index = input.word(), .sub = input.byte()};
  const std::size_t limit = input.byte();
  const auto written = input.take(1 + limit % 64U);
  auto transfer = kind % 2 == 0 || written.empty()
                      ? SdoTransfer::upload(object, limit)
                      : SdoTransfer::download(object, {written.begin(), written.end()});
  (void)transfer.first_frame();
  while (!input.empty()) {
    can::Frame frame{.id = replies};
    const auto data = input.take(8);
    // Of most of them the object is the right one, so that the transfer goes on.
    frame.size = static_cast<std::uint8_t>(data.size());
    std::ranges::copy(data, frame.data.begin());
    if ((kind & 2U) != 0 && data.size() == 8 && (data[0] & 0xE0U) != 0 && (data[0] & 0xE0U) != 0x20U) {
      frame.data[1] = static_cast<std::uint8_t>(object.index & 0xFFU);
      frame.data[2] = static_cast<std::uint8_t>(object.index >> 8U);
      frame.data[3] = object.sub;
    }
    const auto step = transfer.on_reply(canopen::parse_sdo_reply(frame));
    // An expedited reply that does not say how many of its bytes count has 4, and a segment brings 7 at most.
    if (!transfer.is_download())
      expect(transfer.bytes().size() <= std::max<std::size_t>(limit, 4) + 7, "an upload is bounded");
    if (step.kind == SdoTransfer::Step::Kind::done && transfer.size_indicated() && !transfer.is_download())
      expect(transfer.bytes().size() <= limit, "what is taken is within the limit");
    if (step.kind == SdoTransfer::Step::Kind::send)
      expect(step.frame.has_value(), "what goes on has a frame");
    if (step.kind == SdoTransfer::Step::Kind::failed)
      expect(!step.error.message.empty(), "what fails says why");
    if (step.kind == SdoTransfer::Step::Kind::failed || step.kind == SdoTransfer::Step::Kind::done) break;
  }
  (void)transfer.complete_at_server();
  (void)transfer.abort(canopen::SdoAbort::timed_out);
}

}  // namespace axisd::fuzz
