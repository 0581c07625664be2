#include "api/server/command_stream.hpp"

#include <utility>

#include "api/server/convert.hpp"
#include "api/server/status.hpp"

namespace axisd::server {

// A command changes its state twice; more than this only piles up behind a reader that does not read.
constexpr std::size_t most_changes = 16;

CommandStream::CommandStream(const Services& services, Admission::Ticket ticket)
    : reply_(services.reply), calls_(services.calls), ticket_(std::move(ticket)) {}

grpc::ServerWriteReactor<v1::WatchCommandResponse>* CommandStream::start(const Services& services,
                                                                         const std::string& id,
                                                                         Admission::Ticket ticket) {
  const auto stream = std::make_shared<CommandStream>(services, std::move(ticket));
  if (!services.calls->add(stream)) return nullptr;
  stream->self_ = stream;
  // The subscription must not keep the stream alive that owns it.
  auto subscription = services.machine.watch_command(
      id, [weak = stream->weak_from_this(), reply = stream->reply_](Result<Command> change) {
        reply->post([weak, change = std::move(change)]() mutable {
          if (const auto self = weak.lock()) self->changed(std::move(change));
        });
      });
  stream->reply_->post([stream, subscription = std::move(subscription)]() mutable {
    if (!stream->finished_) stream->subscription_ = std::move(subscription);
  });
  return stream.get();
}

void CommandStream::changed(Result<Command> change) {
  if (finished_ || end_with_) return;
  if (!change) return end(to_status(change.error()));
  const bool last = ended(change->state);
  if (changes_.size() >= most_changes) changes_.pop_front();
  changes_.push_back(*std::move(change));
  if (last) return end(grpc::Status::OK);
  go_on();
}

void CommandStream::end(const grpc::Status& status) {
  if (!end_with_) end_with_ = status;
  go_on();
}

void CommandStream::go_on() {
  if (writing_ || finished_) return;
  if (changes_.empty()) {
    if (!end_with_) return;
    finished_ = true;
    subscription_.reset();
    ticket_.release();
    return Finish(*end_with_);
  }
  response_.Clear();
  to_proto(changes_.front(), *response_.mutable_command());
  changes_.pop_front();
  writing_ = true;
  StartWrite(&response_);
}

void CommandStream::close(const grpc::Status& status) {
  reply_->post([stream = shared_from_this(), status] {
    stream->changes_.clear();
    stream->end(status);
  });
}

void CommandStream::OnWriteDone(bool ok) {
  reply_->post([stream = shared_from_this(), ok] {
    stream->writing_ = false;
    if (ok) return stream->go_on();
    stream->changes_.clear();
    stream->end(grpc::Status::CANCELLED);
  });
}

void CommandStream::OnCancel() { close(grpc::Status::CANCELLED); }

void CommandStream::OnDone() {
  calls_->remove(this);
  const auto last = std::move(self_);  // may end this object, after this function
}

}  // namespace axisd::server
