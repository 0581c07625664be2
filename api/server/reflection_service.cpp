#include "api/server/reflection_service.hpp"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/unknown_field_set.h>
#include <grpcpp/impl/codegen/proto_utils.h>
#include <grpcpp/impl/codegen/server_callback_handlers.h>
#include <grpcpp/impl/rpc_service_method.h>

#include <memory>
#include <optional>

#include "api/server/status.hpp"
#include "buses/limited_log.hpp"

namespace axisd::server {
namespace {

using google::protobuf::DescriptorPool;
using google::protobuf::FileDescriptor;
using google::protobuf::UnknownFieldSet;

// Fields of ServerReflectionRequest and ServerReflectionResponse.
constexpr int file_by_filename = 3, file_containing_symbol = 4, list_services = 7;
constexpr int original_request = 2, file_descriptor_response = 4, list_services_response = 6,
              error_response = 7;

std::string encoded(const UnknownFieldSet& fields) {
  std::string bytes;
  fields.SerializeToString(&bytes);
  return bytes;
}

std::string encoded(const FileDescriptor& file) {
  google::protobuf::FileDescriptorProto proto;
  file.CopyTo(&proto);
  return proto.SerializeAsString();
}

std::string list_of(const std::vector<std::string>& services) {
  UnknownFieldSet list;
  for (const auto& name : services) {
    UnknownFieldSet service;
    service.AddLengthDelimited(1, name);
    list.AddLengthDelimited(1, encoded(service));
  }
  return encoded(list);
}

std::string error_of(grpc::StatusCode code, const char* message) {
  UnknownFieldSet error;
  error.AddVarint(1, static_cast<std::uint64_t>(code));
  error.AddLengthDelimited(2, message);
  return encoded(error);
}

/// A stream: a question is read, its answer is written, then the next question is read. Thread: reply, except
/// where gRPC's threads call (On..., close()).
class ReflectionStream final : public grpc::ServerBidiReactor<ReflectionMessage, ReflectionMessage>,
                               public OpenCall,
                               public Stallable,
                               public std::enable_shared_from_this<ReflectionStream> {
 public:
  ReflectionStream(const Services& services, grpc::CallbackServerContext* context, Admission::Ticket ticket,
                   const std::vector<std::string>& told)
      : services_(services), told_(told), context_(context), ticket_(std::move(ticket)) {}

  /// Takes gRPC's share of the stream. False: the server is shutting down. Thread: gRPC.
  [[nodiscard]] bool open() {
    auto judge = services_.callers.judge_of(*context_);
    if (!services_.calls->add(shared_from_this(), context_->peer(), std::move(judge))) return false;
    self_ = shared_from_this();
    StartRead(&question_);
    return true;
  }

  void OnReadDone(bool ok) override {
    // Made here: the reply thread has others to serve.
    if (ok) answer_ = reflect(question_, told_);
    post([ok](ReflectionStream& stream) { ok ? stream.write() : stream.end(grpc::Status::OK); });
  }
  void OnWriteDone(bool ok) override {
    post([ok](ReflectionStream& stream) {
      stream.write_began_.reset();
      if (stream.ended_) return;
      if (!ok) return stream.end(grpc::Status::CANCELLED);
      stream.question_.Clear();
      stream.StartRead(&stream.question_);
    });
  }
  void OnCancel() override { close(grpc::Status::CANCELLED); }
  void OnDone() override {
    services_.calls->remove(this);
    const auto last = std::move(self_);  // may end this object, after this function
  }
  void close(const grpc::Status& status) override {
    post([status](ReflectionStream& stream) { stream.end(status); });
  }

  [[nodiscard]] std::optional<TimePoint> writing_since() const override { return write_began_; }
  [[nodiscard]] bool closing() const override { return ended_; }
  void cancel() override {
    if (ended_) return;
    log_limited(spdlog::level::warn, ticket_.client(), "streams",
                fmt::format("{} stopped reading its stream: cancelled", ticket_.client()));
    context_->TryCancel();
  }

 private:
  template <class Job>
  void post(const Job& job) {
    services_.reply->post([stream = shared_from_this(), job] { job(*stream); });
  }
  void write() {
    if (ended_) return;
    write_began_ = monotonic_now();
    services_.guard->watch(weak_from_this());
    StartWrite(&answer_);
  }
  void end(const grpc::Status& status) {
    if (std::exchange(ended_, true)) return;
    ticket_.release();
    services_.calls->answered(this);
    Finish(status);
  }

  const Services services_;
  const std::vector<std::string>& told_;        ///< the service's, which outlives its streams
  grpc::CallbackServerContext* const context_;  ///< valid until Finish was called
  Admission::Ticket ticket_;
  ReflectionMessage question_, answer_;
  std::optional<TimePoint> write_began_;
  bool ended_ = false;
  std::shared_ptr<ReflectionStream> self_;  ///< gRPC's share, until OnDone
};

/// A stream that ends before it begins.
class RefusedReflection final : public grpc::ServerBidiReactor<ReflectionMessage, ReflectionMessage> {
 public:
  explicit RefusedReflection(const grpc::Status& status) { Finish(status); }
  void OnDone() override { delete this; }
};

}  // namespace

ReflectionMessage reflect(const ReflectionMessage& question, const std::vector<std::string>& services) {
  ReflectionMessage answer;
  auto& fields = *answer.GetReflection()->MutableUnknownFields(&answer);
  fields.AddLengthDelimited(original_request, question.SerializeAsString());
  const auto& pool = *DescriptorPool::generated_pool();
  const auto tell = [&](const FileDescriptor* file) {
    if (file == nullptr)
      return fields.AddLengthDelimited(error_response,
                                       error_of(grpc::StatusCode::NOT_FOUND, "there is no such file"));
    UnknownFieldSet files;
    files.AddLengthDelimited(1, encoded(*file));
    fields.AddLengthDelimited(file_descriptor_response, encoded(files));
  };
  const auto& asked = question.GetReflection()->GetUnknownFields(question);
  for (int i = 0; i < asked.field_count(); ++i) {
    const auto& field = asked.field(i);
    if (field.type() != google::protobuf::UnknownField::TYPE_LENGTH_DELIMITED) continue;
    if (field.number() == list_services)
      return fields.AddLengthDelimited(list_services_response, list_of(services)), answer;
    if (field.number() == file_by_filename)
      return tell(pool.FindFileByName(field.length_delimited())), answer;
    if (field.number() == file_containing_symbol)
      return tell(pool.FindFileContainingSymbol(field.length_delimited())), answer;
  }
  // What asks for extensions, which the contract has none of.
  fields.AddLengthDelimited(error_response, error_of(grpc::StatusCode::UNIMPLEMENTED, "this is not told"));
  return answer;
}

ReflectionService::ReflectionService(const Services& services) : services_(services) {
  using Handler = grpc::internal::CallbackBidiHandler<ReflectionMessage, ReflectionMessage>;
  using grpc::internal::RpcMethod;
  using grpc::internal::RpcServiceMethod;
  for (int i = 0; const auto* path : paths) {
    AddMethod(new RpcServiceMethod(path, RpcMethod::BIDI_STREAMING, nullptr));
    MarkMethodCallback(
        i++, new Handler([this](grpc::CallbackServerContext* context)
                             -> grpc::ServerBidiReactor<ReflectionMessage, ReflectionMessage>* {
          const auto client = services_.callers.peer_of(*context).name;
          auto ticket = services_.admission.admit(client, Admission::Kind::reflection);
          if (!ticket) return new RefusedReflection(to_status(ticket.error()));
          const auto stream =
              std::make_shared<ReflectionStream>(services_, context, *std::move(ticket), told_);
          if (!stream->open()) return new RefusedReflection(shutting_down());
          return stream.get();
        }));
  }
}

}  // namespace axisd::server
