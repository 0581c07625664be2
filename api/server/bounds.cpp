#include "api/server/bounds.hpp"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "axisd/v1/bounds.pb.h"

namespace axisd::server {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::DescriptorPool;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

struct Plan;

/// What is looked at in one field. 0 and nullptr: not that.
struct Rule {
  const FieldDescriptor* field = nullptr;
  std::uint32_t items = 0, bytes = 0;
  const Plan* inside = nullptr;
};

/// What is looked at in one message.
struct Plan {
  std::vector<Rule> rules;
};

/// The bounds of all requests. Thread: any, once it is made.
class Table {
 public:
  Table() {
    for (const std::string_view service :
         {"audit", "axis", "bus", "command", "drive", "event", "group", "lease", "system"}) {
      const auto* file =
          DescriptorPool::generated_pool()->FindFileByName(fmt::format("axisd/v1/{}_service.proto", service));
      if (file == nullptr) continue;
      for (int i = 0; i < file->service_count(); ++i)
        for (int j = 0; j < file->service(i)->method_count(); ++j)
          (void)plan_of(*file->service(i)->method(j)->input_type());
    }
  }

  /// nullptr: it is no request.
  [[nodiscard]] const Plan* find(const Descriptor* type) const {
    const auto found = plans_.find(type);
    return found == plans_.end() ? nullptr : &found->second;
  }

 private:
  const Plan* plan_of(const Descriptor& type) {
    const auto [place, added] = plans_.try_emplace(&type);
    auto& plan = place->second;
    if (added)
      for (int i = 0; i < type.field_count(); ++i) add(plan, *type.field(i));
    return &plan;
  }

  void add(Plan& plan, const FieldDescriptor& field) {
    const auto& options = field.options();
    const v1::Bounds none;
    add(plan, field, options.HasExtension(v1::bounds) ? options.GetExtension(v1::bounds) : none);
  }

  void add(Plan& plan, const FieldDescriptor& field, const v1::Bounds& bounds) {
    Rule rule{.field = &field};
    if (field.is_repeated()) rule.items = bounds.max_items();
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_STRING && !bounds.tolerated())
      rule.bytes = bounds.max_bytes();
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE && !bounds.tolerated()) {
      const auto& type = *field.message_type();
      if (type.file()->package() == v1::Bounds::descriptor()->file()->package())
        rule.inside = plan_of(type);
      else if (field.options().HasExtension(v1::bounds))
        rule.inside = plan_of_foreign(type, bounds);
    }
    if (rule.items != 0 || rule.bytes != 0 || rule.inside != nullptr) plan.rules.push_back(rule);
  }

  /// Of a type that cannot have bounds of its own, such as FieldMask.
  const Plan* plan_of_foreign(const Descriptor& type, const v1::Bounds& bounds) {
    auto& plan = foreign_.emplace_back();
    for (int i = 0; i < type.field_count(); ++i)
      if (type.field(i)->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) add(plan, *type.field(i), bounds);
    return &plan;
  }

  std::map<const Descriptor*, Plan> plans_;
  std::deque<Plan> foreign_;
};

/// Where in the request: made into text only if it is too much there.
struct Path {
  const Path* outer = nullptr;
  const FieldDescriptor* field = nullptr;
  int index = -1;

  [[nodiscard]] std::string text() const {
    auto own = index < 0 ? field->name() : fmt::format("{}[{}]", field->name(), index);
    return outer == nullptr ? own : fmt::format("{}.{}", outer->text(), own);
  }
};

std::unexpected<Error> too_many(const Path& path, int sent, std::uint32_t permitted) {
  return fail(Reason::invalid_argument,
              fmt::format("{} has {} entries; {} are permitted", path.text(), sent, permitted),
              fmt::format("give at most {} in one call", permitted));
}

Result<void> check_length(const Path& path, std::size_t sent, std::uint32_t permitted) {
  if (permitted == 0 || sent <= permitted) return {};
  return fail(Reason::invalid_argument,
              fmt::format("{} has {} bytes; {} are permitted", path.text(), sent, permitted),
              fmt::format("give at most {} bytes", permitted));
}

Result<void> check(const Plan& plan, const Message& message, const Path* outer);

Result<void> check_repeated(const Rule& rule, const Message& message, const Path* outer) {
  const auto& reflection = *message.GetReflection();
  const int size = reflection.FieldSize(message, rule.field);
  Path path{.outer = outer, .field = rule.field};
  if (rule.items != 0 && static_cast<std::uint32_t>(size) > rule.items)
    return too_many(path, size, rule.items);
  if (rule.bytes == 0 && rule.inside == nullptr) return {};
  std::string scratch;
  for (path.index = 0; path.index < size; ++path.index) {
    const auto within =
        rule.inside != nullptr
            ? check(*rule.inside, reflection.GetRepeatedMessage(message, rule.field, path.index), &path)
            : check_length(
                  path,
                  reflection.GetRepeatedStringReference(message, rule.field, path.index, &scratch).size(),
                  rule.bytes);
    if (!within) return within;
  }
  return {};
}

Result<void> check(const Plan& plan, const Message& message, const Path* outer) {
  const auto& reflection = *message.GetReflection();
  for (const auto& rule : plan.rules) {
    Result<void> within;
    const Path path{.outer = outer, .field = rule.field};
    if (rule.field->is_repeated()) {
      within = check_repeated(rule, message, outer);
    } else if (rule.inside != nullptr) {
      if (reflection.HasField(message, rule.field))
        within = check(*rule.inside, reflection.GetMessage(message, rule.field), &path);
    } else {
      std::string scratch;
      within =
          check_length(path, reflection.GetStringReference(message, rule.field, &scratch).size(), rule.bytes);
    }
    if (!within) return within;
  }
  return {};
}

}  // namespace

Result<void> check_bounds(const Message& request) {
  static const Table table;
  const auto* plan = table.find(request.GetDescriptor());
  return plan == nullptr ? Result<void>{} : check(*plan, request, nullptr);
}

}  // namespace axisd::server
