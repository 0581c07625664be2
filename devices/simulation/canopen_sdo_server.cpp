#include "devices/simulation/canopen_sdo_server.hpp"

#include <algorithm>

namespace axisd::simulation {

namespace {
/// No object of a simulated node is longer; what is sent beyond is refused, not kept.
constexpr std::size_t longest_download = 256;
}  // namespace

CanopenSdoServer::Bytes CanopenSdoServer::named(std::uint8_t command) const {
  return {command, static_cast<std::uint8_t>(index_), static_cast<std::uint8_t>(index_ >> 8U), sub_};
}

CanopenSdoServer::Bytes CanopenSdoServer::abort(std::uint32_t code) {
  transfer_ = Transfer::none;
  auto bytes = named(0x80);
  for (unsigned i = 0; i < 4; ++i) bytes.at(4 + i) = static_cast<std::uint8_t>(code >> (8 * i));
  return bytes;
}

std::optional<CanopenSdoServer::Bytes> CanopenSdoServer::on_request(std::span<const std::uint8_t, 8> request,
                                                                    CanopenObjects& objects) {
  const auto command = static_cast<unsigned>(request[0] >> 5U);
  if (command == 4) {
    transfer_ = Transfer::none;
    return std::nullopt;
  }
  if (command == 0) return download_segment(request, objects);
  if (command == 3) return upload_segment(request[0]);
  index_ = static_cast<std::uint16_t>(request[1] | request[2] << 8U);
  sub_ = request[3];
  if (command == 1) return begin_download(request, objects);
  if (command == 2) return begin_upload(objects);
  return abort(abort_code::bad_command);
}

CanopenSdoServer::Bytes CanopenSdoServer::begin_download(std::span<const std::uint8_t, 8> request,
                                                         CanopenObjects& objects) {
  const bool expedited = (request[0] & 2U) != 0, sized = (request[0] & 1U) != 0;
  if (expedited) {
    transfer_ = Transfer::none;
    const auto* row = objects.dictionary().find(index_, sub_);
    // Without a size the object's own counts.
    const std::size_t size = sized ? 4U - (request[0] >> 2U & 3U) : row != nullptr ? row->size : 4U;
    const auto code = objects.write(index_, sub_, request.subspan(4).first(std::min<std::size_t>(size, 4)),
                                    settings_.shorter_writes);
    return code == abort_code::none ? named(0x60) : abort(code);
  }
  const auto* row = objects.dictionary().find(index_, sub_);
  if (row == nullptr) return abort(objects.dictionary().missing(index_));
  if (row->access == Access::ro) return abort(abort_code::read_only);
  announced_.reset();
  if (sized)
    announced_ = static_cast<std::uint32_t>(request[4]) | static_cast<std::uint32_t>(request[5]) << 8U |
                 static_cast<std::uint32_t>(request[6]) << 16U |
                 static_cast<std::uint32_t>(request[7]) << 24U;
  if (announced_ && *announced_ > row->size) return abort(abort_code::too_long);
  transfer_ = Transfer::download;
  toggle_ = false;
  data_.clear();
  return named(0x60);
}

CanopenSdoServer::Bytes CanopenSdoServer::download_segment(std::span<const std::uint8_t, 8> request,
                                                           CanopenObjects& objects) {
  if (transfer_ != Transfer::download) return abort(abort_code::bad_command);
  if (((request[0] & 0x10U) != 0) != toggle_) return abort(abort_code::toggle);
  const auto size = 7U - (request[0] >> 1U & 7U);
  const auto part = request.subspan(1).first(size);
  data_.insert(data_.end(), part.begin(), part.end());
  if (data_.size() > announced_.value_or(longest_download)) return abort(abort_code::too_long);
  const auto answer = static_cast<std::uint8_t>(0x20U | (toggle_ ? 0x10U : 0U));
  toggle_ = !toggle_;
  if ((request[0] & 1U) == 0) return {answer};
  if (announced_ && data_.size() != *announced_) return abort(abort_code::size_differs);
  transfer_ = Transfer::none;
  const auto code = objects.write(index_, sub_, data_, settings_.shorter_writes);
  return code == abort_code::none ? Bytes{answer} : abort(code);
}

CanopenSdoServer::Bytes CanopenSdoServer::begin_upload(CanopenObjects& objects) {
  transfer_ = Transfer::none;
  if (const auto code = objects.read(index_, sub_, data_); code != abort_code::none) return abort(code);
  if (data_.size() <= 4 && !data_.empty() && !settings_.segmented_uploads) {
    auto bytes = named(static_cast<std::uint8_t>(0x43U | (4U - data_.size()) << 2U));
    std::ranges::copy(data_, bytes.begin() + 4);
    return bytes;
  }
  transfer_ = Transfer::upload;
  toggle_ = false;
  sent_ = 0;
  auto bytes = named(0x41);
  for (unsigned i = 0; i < 4; ++i) bytes.at(4 + i) = static_cast<std::uint8_t>(data_.size() >> (8 * i));
  return bytes;
}

CanopenSdoServer::Bytes CanopenSdoServer::upload_segment(std::uint8_t command) {
  if (transfer_ != Transfer::upload) return abort(abort_code::bad_command);
  if (((command & 0x10U) != 0) != toggle_) return abort(abort_code::toggle);
  const auto size = std::min<std::size_t>(7, data_.size() - sent_);
  const bool last = sent_ + size == data_.size();
  Bytes bytes{static_cast<std::uint8_t>((toggle_ ? 0x10U : 0U) | (7U - size) << 1U | (last ? 1U : 0U))};
  std::copy_n(data_.begin() + static_cast<std::ptrdiff_t>(sent_), size, bytes.begin() + 1);
  sent_ += size;
  toggle_ = !toggle_;
  if (last) transfer_ = Transfer::none;
  return bytes;
}

}  // namespace axisd::simulation
