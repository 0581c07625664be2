#include "buses/canopen/sdo_transfer.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "buses/canopen/sdo_abort.hpp"

namespace axisd::canopen {

namespace {

constexpr std::size_t expedited_capacity = 4, segment_capacity = 7;
using Step = SdoTransfer::Step;

Step send(const SdoData& frame) { return {.kind = Step::Kind::send, .frame = frame}; }
Step done() { return {.kind = Step::Kind::done}; }

}  // namespace

SdoTransfer SdoTransfer::upload(Object object, std::size_t limit) { return {object, false, {}, limit}; }

SdoTransfer SdoTransfer::download(Object object, Bytes bytes) {
  const auto limit = bytes.size();
  return {object, true, std::move(bytes), limit};
}

SdoData SdoTransfer::first_frame() {
  if (!download_) return upload_request(object_);
  if (bytes_.size() > expedited_capacity)
    return segmented_download_request(object_, static_cast<std::uint32_t>(bytes_.size()));
  all_sent_ = true;
  return expedited_download_request(object_, bytes_);
}

SdoData SdoTransfer::abort(SdoAbort code) const {
  return abort_frame(object_, static_cast<std::uint32_t>(code));
}

Step SdoTransfer::on_reply(const SdoReply& reply) {
  if (const auto* aborted = std::get_if<Aborted>(&reply)) return on_aborted(*aborted);
  if (phase_ == Phase::opening) {
    // What does not name this object answers an earlier request: segments of it, too.
    if (!download_) {
      if (const auto* whole = std::get_if<ExpeditedUpload>(&reply); whole && whole->object == object_)
        return on_opened(*whole);
      if (const auto* begun = std::get_if<SegmentedUpload>(&reply); begun && begun->object == object_)
        return on_opened(*begun);
    } else if (const auto* accepted = std::get_if<DownloadAccepted>(&reply);
               accepted && accepted->object == object_) {
      return on_accepted();
    }
    return {};
  }
  // The server answered the opening, so nothing older can follow: what does not fit now is an error.
  if (!download_) {
    if (const auto* segment = std::get_if<UploadSegment>(&reply)) return on_segment(*segment);
  } else if (const auto* segment = std::get_if<DownloadSegmentAccepted>(&reply)) {
    return on_segment_accepted(*segment);
  }
  return broken(SdoAbort::bad_command, "the node answered a segment with something else");
}

Step SdoTransfer::on_aborted(const Aborted& aborted) const {
  // In mid-transfer some servers do not fill in the object; before, it must be the one that was asked for.
  if (phase_ == Phase::opening && aborted.object != object_) return {};
  return {.kind = Step::Kind::failed, .error = abort_error(object_, aborted.code)};
}

Step SdoTransfer::on_opened(const ExpeditedUpload& reply) {
  if (reply.size_indicated && reply.bytes.size() > limit_) return too_long(reply.bytes.size());
  bytes_ = reply.bytes;
  size_indicated_ = reply.size_indicated;
  return done();
}

Step SdoTransfer::on_opened(const SegmentedUpload& reply) {
  if (reply.total_size && *reply.total_size > limit_) return too_long(*reply.total_size);
  total_size_ = reply.total_size;
  size_indicated_ = reply.total_size.has_value();
  phase_ = Phase::segments;
  return send(upload_segment_request(toggle_));
}

Step SdoTransfer::on_segment(const UploadSegment& reply) {
  if (reply.toggle != toggle_) return broken(SdoAbort::toggle_not_alternated, "a segment came twice");
  bytes_.insert(bytes_.end(), reply.bytes.begin(), reply.bytes.end());
  if (bytes_.size() > limit_) return too_long(bytes_.size());
  if (total_size_ && (bytes_.size() > *total_size_ || (reply.last && bytes_.size() != *total_size_)))
    return broken(SdoAbort::length_mismatch,
                  fmt::format("{} bytes came where {} were announced", bytes_.size(), *total_size_));
  if (reply.last) return done();
  toggle_ = !toggle_;
  return send(upload_segment_request(toggle_));
}

Step SdoTransfer::on_accepted() {
  if (bytes_.size() <= expedited_capacity) return done();
  phase_ = Phase::segments;
  return send(next_download_segment());
}

SdoData SdoTransfer::next_download_segment() {
  const auto size = std::min(segment_capacity, bytes_.size() - sent_);
  const auto part = std::span(bytes_).subspan(sent_, size);
  sent_ += size;
  all_sent_ = sent_ == bytes_.size();
  return download_segment_request(toggle_, part, all_sent_);
}

Step SdoTransfer::on_segment_accepted(const DownloadSegmentAccepted& reply) {
  if (reply.toggle != toggle_)
    return broken(SdoAbort::toggle_not_alternated, "a segment was confirmed twice");
  if (all_sent_) return done();
  toggle_ = !toggle_;
  return send(next_download_segment());
}

Step SdoTransfer::broken(SdoAbort code, std::string what) const {
  Error error{
      .reason = Reason::no_reply,
      .message = std::move(what),
      .remedy =
          "repeat the request; if it comes again, look for other masters on the network, or check the "
          "drive's firmware version",
      .outcome = complete_at_server() ? Outcome::unknown : Outcome::not_executed};
  error.where.object = object_.key();
  error.where.native_code = static_cast<std::uint32_t>(code);
  return {.kind = Step::Kind::failed, .frame = abort(code), .error = std::move(error)};
}

Step SdoTransfer::too_long(std::uint64_t size) const {
  Error error{.reason = Reason::out_of_range,
              .message = fmt::format("{} bytes came or were announced, at most {} are taken", size, limit_),
              .remedy = "check that it is the right object; raise the limit of the request if it is",
              .outcome = Outcome::not_executed};
  error.where.object = object_.key();
  return {.kind = Step::Kind::failed, .frame = abort(SdoAbort::out_of_memory), .error = std::move(error)};
}

}  // namespace axisd::canopen
