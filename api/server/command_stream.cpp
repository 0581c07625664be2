#include "api/server/command_stream.hpp"

#include <utility>

#include "api/server/convert.hpp"
#include "api/server/status.hpp"

namespace axisd::server {

// A command changes its state twice; more than this only piles up behind a reader that does not read.
constexpr std::size_t most_changes = 16;

grpc::ServerWriteReactor<v1::WatchCommandResponse>* CommandStream::start(const Services& services,
                                                                         grpc::CallbackServerContext* context,
                                                                         const std::string& id,
                                                                         Admission::Ticket ticket) {
  const auto stream = std::make_shared<CommandStream>(services, context, std::move(ticket));
  if (!stream->open()) return nullptr;
  // The subscription must not keep the stream alive that owns it.
  auto subscription = services.machine.watch_command(
      id, [weak = std::weak_ptr(stream), reply = services.reply](Result<Command> change) {
        reply->post([weak, change = std::move(change)]() mutable {
          if (const auto self = weak.lock()) self->changed(std::move(change));
        });
      });
  services.reply->post([stream, subscription = std::move(subscription)]() mutable {
    if (!stream->ended()) stream->subscription_ = std::move(subscription);
  });
  return stream.get();
}

void CommandStream::changed(Result<Command> change) {
  if (ended()) return;
  if (!change) return end(to_status(change.error()));
  const bool last = axisd::ended(change->state);
  if (changes_.size() >= most_changes) changes_.pop_front();
  changes_.push_back(*std::move(change));
  if (last) return end(grpc::Status::OK);
  go_on();
}

bool CommandStream::next(v1::WatchCommandResponse& to) {
  if (changes_.empty()) return false;
  to_proto(changes_.front(), *to.mutable_command());
  changes_.pop_front();
  return true;
}

}  // namespace axisd::server
