#include "spindle/link/client.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

namespace spindle::link {
namespace {

std::uint32_t end_of(const RegisterRange& range) {
  return std::uint32_t{range.first} + range.count;
}

RegisterRange span_of(const RegisterRange& front, std::uint32_t end) {
  return {front.table, front.first, static_cast<std::uint16_t>(end - front.first)};
}

constexpr std::uint32_t all_registers = 0x10000;

bool is_forbidden(const RegisterRange& range, const ReadLimits& limits) {
  const auto& shapes = limits.forbidden_shapes;
  return range.count > 1 &&
         std::any_of(shapes.begin(), shapes.end(), [&](const RegisterRange& shape) {
           return shape.table == range.table && shape.count == range.count;
         });
}

/// Cuts what alone is too long for one request or has the forbidden shape.
void append_pieces(RegisterRange range, const ReadLimits& limits,
                   std::vector<RegisterRange>& pieces) {
  const std::uint16_t longest = std::max<std::uint16_t>(limits.most_in_read(range.table), 1);
  while (range.count > longest || is_forbidden(range, limits)) {
    std::uint16_t size = std::min(range.count, longest);
    if (size == range.count || is_forbidden({range.table, range.first, size}, limits)) --size;
    pieces.push_back({range.table, range.first, size});
    range = {range.table, static_cast<std::uint16_t>(range.first + size),
             static_cast<std::uint16_t>(range.count - size)};
  }
  pieces.push_back(range);
}

/// The areas said to be absent that a range touches.
std::vector<RegisterRange> holes_of(const RegisterRange& range, const ReadLimits& limits) {
  std::vector<RegisterRange> holes;
  std::copy_if(limits.absent.begin(), limits.absent.end(), std::back_inserter(holes),
               [&](const RegisterRange& area) {
                 return area.table == range.table && area.first < end_of(range) &&
                        range.first < end_of(area);
               });
  return holes;
}

/// What is said to be absent shares a request with nothing but its own hole.
bool may_share(const RegisterRange& a, const RegisterRange& b, const ReadLimits& limits) {
  const auto holes = holes_of(a, limits);
  if (holes != holes_of(b, limits)) return false;
  const auto lies_within = [&](const RegisterRange& range) {
    return holes.front().first <= range.first && end_of(range) <= end_of(holes.front());
  };
  return holes.empty() || (holes.size() == 1 && lies_within(a) && lies_within(b));
}

bool may_bridge(modbus::RegisterTable table, std::uint32_t from, std::uint32_t to,
                const ReadLimits& limits, const std::set<std::uint32_t>& absent) {
  if (from >= to) return true;
  const auto first = register_key(table, static_cast<std::uint16_t>(from));
  const auto last = register_key(table, static_cast<std::uint16_t>(to - 1));
  const auto hole = absent.lower_bound(first);
  if (hole != absent.end() && *hole <= last) return false;
  const auto holds_hole = [&](const RegisterRange& area) {
    return area.table == table && area.first < to && from < end_of(area);
  };
  if (std::any_of(limits.absent.begin(), limits.absent.end(), holds_hole)) return false;
  if (to - from <= limits.max_gap) return true;
  return std::any_of(limits.contiguous.begin(), limits.contiguous.end(),
                     [&](const RegisterRange& area) {
                       return area.table == table && area.first <= from && to <= end_of(area);
                     });
}

void add(std::vector<PlannedRead>& plan, const RegisterRange& piece, const ReadLimits& limits,
         const std::set<std::uint32_t>& absent) {
  const bool joins = !plan.empty() && plan.back().range.table == piece.table &&
                     may_share(plan.back().range, piece, limits);
  if (joins) {
    PlannedRead& last = plan.back();
    const std::uint32_t end = std::max(end_of(last.range), end_of(piece));
    if (end - last.range.first <= limits.most_in_read(piece.table) &&
        may_bridge(piece.table, end_of(last.range), piece.first, limits, absent)) {
      last.range = span_of(last.range, end);
      last.wanted.push_back(piece);
      return;
    }
  }
  plan.push_back({piece, {piece}});
}

/// Splits so that the first part keeps the wanted ranges in front of `at`.
std::pair<PlannedRead, PlannedRead> split_at(const PlannedRead& planned, std::size_t at) {
  const auto middle = planned.wanted.begin() + static_cast<std::ptrdiff_t>(at);
  PlannedRead head{.range = {}, .wanted = {planned.wanted.begin(), middle}};
  PlannedRead tail{.range = {}, .wanted = {middle, planned.wanted.end()}};
  for (PlannedRead* part : {&head, &tail}) {
    std::uint32_t end = 0;
    for (const RegisterRange& range : part->wanted) end = std::max(end, end_of(range));
    part->range = span_of(part->wanted.front(), end);
  }
  return {std::move(head), std::move(tail)};
}

void append_allowed(PlannedRead planned, const ReadLimits& limits, std::vector<PlannedRead>& plan) {
  if (!is_forbidden(planned.range, limits)) {
    plan.push_back(std::move(planned));
    return;
  }
  auto [head, tail] = split_at(planned, planned.wanted.size() - 1);
  append_allowed(std::move(head), limits, plan);
  append_allowed(std::move(tail), limits, plan);
}

Error exception_error(const modbus::Pdu& request, std::uint8_t code) {
  const std::string tried = modbus::describe_request(request);
  const std::string_view name = modbus::exception_name(code);
  return {.code = Errc::exception_response,
          .message = name.empty()
                         ? fmt::format("the tool refused '{}' with exception {:02X}", tried, code)
                         : fmt::format("the tool refused '{}' with exception {:02X} ({})", tried,
                                       code, name),
          .tried = tried,
          .exception = code};
}

/// Whether a block may be refused for what stands in a part of it.
bool may_be_of_a_part(const Error& error) {
  using modbus::ExceptionCode;
  return error.exception == static_cast<std::uint8_t>(ExceptionCode::illegal_data_address) ||
         error.exception == static_cast<std::uint8_t>(ExceptionCode::illegal_data_value) ||
         error.exception == static_cast<std::uint8_t>(ExceptionCode::server_device_failure);
}

bool is_missing_register(const Error& error) {
  return error.exception == static_cast<std::uint8_t>(modbus::ExceptionCode::illegal_data_address);
}

std::size_t count_pieces(const std::vector<PlannedRead>& plan) {
  std::size_t pieces = 0;
  for (const PlannedRead& planned : plan) pieces += planned.wanted.size();
  return pieces;
}

}  // namespace

bool is_lost_answer(const Error& error) {
  return error.code == Errc::no_answer || error.code == Errc::incomplete_answer ||
         error.code == Errc::malformed_answer || error.code == Errc::bad_checksum;
}

std::vector<PlannedRead> plan_reads(const std::vector<RegisterRange>& wanted,
                                    const ReadLimits& limits,
                                    const std::set<std::uint32_t>& absent) {
  std::vector<RegisterRange> pieces;
  for (const RegisterRange& range : wanted) append_pieces(range, limits, pieces);
  std::sort(pieces.begin(), pieces.end());
  pieces.erase(std::unique(pieces.begin(), pieces.end()), pieces.end());
  std::vector<PlannedRead> merged;
  for (const RegisterRange& piece : pieces) add(merged, piece, limits, absent);
  std::vector<PlannedRead> plan;
  for (PlannedRead& planned : merged) append_allowed(std::move(planned), limits, plan);
  return plan;
}

std::vector<OtherRead> other_reads(const RegisterRange& range, const ReadLimits& limits,
                                   const std::set<std::uint32_t>& absent) {
  constexpr std::uint16_t most_more = 3;
  // Eight coils make a byte more, so that no two answers look alike.
  constexpr std::uint16_t bits_per_byte = 8;
  const std::uint16_t step = modbus::holds_bits(range.table) ? bits_per_byte : 1;
  std::vector<OtherRead> others;
  for (std::uint16_t turn = 1; turn <= most_more; ++turn) {
    const auto more = static_cast<std::uint16_t>(turn * step);
    if (range.count + more > limits.most_in_read(range.table)) break;
    for (const std::uint16_t before : {std::uint16_t{0}, more}) {
      if (before > range.first || end_of(range) + more - before > all_registers) continue;
      const RegisterRange other{range.table, static_cast<std::uint16_t>(range.first - before),
                                static_cast<std::uint16_t>(range.count + more)};
      const bool allowed = limits.neighbours == Neighbours::anywhere ||
                           may_bridge(range.table, other.first, end_of(other), limits, absent);
      if (!allowed || is_forbidden(other, limits)) continue;
      others.push_back({modbus::read_request(other.table, {other.first}, other.count), before});
      break;
    }
  }
  return others;
}

void RegisterImage::store(const RegisterRange& range, RegisterView values) {
  std::uint32_t key = register_key(range.table, range.first);
  for (const std::uint16_t value : values) values_.insert_or_assign(values_.end(), key++, value);
}

void RegisterImage::fail(const RegisterRange& range, const Error& error) {
  const std::uint32_t first = register_key(range.table, range.first);
  for (std::uint32_t key = first; key < first + range.count; ++key) {
    errors_.insert_or_assign(key, error);
  }
}

Result<Registers> RegisterImage::get(const RegisterRange& range) const {
  Registers registers;
  registers.reserve(range.count);
  const std::uint32_t first = register_key(range.table, range.first);
  for (std::uint32_t key = first; key < first + range.count; ++key) {
    if (const auto value = values_.find(key); value != values_.end()) {
      registers.push_back(value->second);
      continue;
    }
    if (const auto error = errors_.find(key); error != errors_.end()) {
      return tl::unexpected(error->second);
    }
    return tl::unexpected(Error{.code = Errc::internal,
                                .message = "a register was asked for that had not been read",
                                .register_address = static_cast<std::uint16_t>(key)});
  }
  return registers;
}

Client::Client(Session& session, ReadLimits limits, unsigned retries)
    : session_(&session), limits_(std::move(limits)), retries_(retries) {}

Result<modbus::Pdu> Client::ask(const modbus::Pdu& request, unsigned retries,
                                const std::vector<OtherRead>& others) {
  auto response = session_->transact(request, others);
  std::optional<Error> damaged;
  for (unsigned retry = 0; retry < retries && !response && is_lost_answer(response.error()) &&
                           !session_->is_out_of_step();
       ++retry) {
    if (response.error().code != Errc::no_answer) damaged = response.error();
    session_->tell_retry(request);
    response = session_->transact(request, others);
  }
  // What came once says more than that nothing came afterwards.
  if (!response && damaged && response.error().code == Errc::no_answer) {
    return tl::unexpected(std::move(*damaged));
  }
  if (!response) return response;
  if (const auto code = modbus::exception_of(*response)) {
    Error error = exception_error(request, *code);
    error.device_code = read_refusal();
    return tl::unexpected(std::move(error));
  }
  return response;
}

/// Empty where there is no such register, or no answer: the exception itself is what matters.
std::optional<std::uint32_t> Client::read_refusal() {
  if (!limits_.refusal) return std::nullopt;
  const RegisterRange& range = *limits_.refusal;
  const auto response =
      session_->transact(modbus::read_request(range.table, {range.first}, range.count));
  if (!response || modbus::exception_of(*response)) return std::nullopt;
  constexpr unsigned bits_per_register = 16;
  std::uint32_t code = 0;
  for (const std::uint16_t word : modbus::registers_of(*response)) {
    code = (code << bits_per_register) | word;
  }
  return code;
}

Result<Registers> Client::read(const RegisterRange& range) {
  return believed([&] { return read_once(range); });
}

/// Reads again, in doubt this time, where it turns out that others are on the line.
template <typename Read>
auto Client::believed(Read read) -> decltype(read()) {
  const Session::Mark mark = session_->mark();
  auto done = read();
  if (!done) return done;
  TRY_LET(const auto undisturbed, session_->is_undisturbed_since(mark));
  return undisturbed ? std::move(done) : read();
}

Result<Registers> Client::read_once(const RegisterRange& range) {
  const auto request = modbus::read_request(range.table, {range.first}, range.count);
  std::vector<OtherRead> others;
  if (!has_ids(session_->options().rules)) {
    others = other_reads(range, limits_, absent_registers());
  }
  return ask(request, retries_, others).map([&](const modbus::Pdu& response) {
    return modbus::registers_of(request, response);
  });
}

Result<Registers> Client::read_once_ever(const RegisterRange& range) {
  constexpr unsigned never = 0;
  const auto request = modbus::read_request(range.table, {range.first}, range.count);
  return ask(request, never).map([&](const modbus::Pdu& response) {
    return modbus::registers_of(request, response);
  });
}

Result<RegisterImage> Client::read_each(const std::vector<RegisterRange>& wanted,
                                        const Progress& progress) {
  return believed([&] { return read_each_once(wanted, progress); });
}

Result<RegisterImage> Client::read_each_once(const std::vector<RegisterRange>& wanted,
                                             const Progress& progress) {
  RegisterImage image;
  const auto plan = plan_reads(askable(wanted, image), limits_, absent_registers());
  const std::size_t total = count_pieces(plan);
  std::size_t done = 0;
  const Settled settled = [&](const PlannedRead& part) {
    done += part.wanted.size();
    if (progress) progress(done, total);
  };
  for (const PlannedRead& planned : plan) {
    auto read = read_or_bisect(planned, image, settled);
    if (!read) return tl::unexpected(std::move(read.error()));
  }
  return image;
}

/// The pieces that are not known to be absent; the others fail in the image.
std::vector<RegisterRange> Client::askable(const std::vector<RegisterRange>& wanted,
                                           RegisterImage& image) const {
  std::vector<RegisterRange> pieces;
  for (const RegisterRange& range : wanted) append_pieces(range, limits_, pieces);
  const auto asked = std::partition(pieces.begin(), pieces.end(), [&](const RegisterRange& piece) {
    return known_absent(piece) == nullptr;
  });
  for (auto piece = asked; piece != pieces.end(); ++piece)
    image.fail(*piece, *known_absent(*piece));
  pieces.erase(asked, pieces.end());
  return pieces;
}

Result<void> Client::read_or_bisect(const PlannedRead& planned, RegisterImage& image,
                                    const Settled& settled) {
  std::vector<PlannedRead> allowed;  // a half may have the shape that the whole had not
  append_allowed(planned, limits_, allowed);
  for (const PlannedRead& part : allowed) {
    auto registers = read_once(part.range);
    if (registers) {
      image.store(part.range, *registers);
      settled(part);
      continue;
    }
    if (registers.error().code != Errc::exception_response) {
      return tl::unexpected(std::move(registers.error()));
    }
    // A hole that is refused is as the profile says.
    const bool is_final = !may_be_of_a_part(registers.error()) || part.wanted.size() == 1 ||
                          !holes_of(part.range, limits_).empty();
    if (is_final) {
      remember(part, registers.error(), image);
      settled(part);
      continue;
    }
    const auto [head, tail] = split_at(part, part.wanted.size() / 2);
    for (const PlannedRead& half : {head, tail}) {
      TRY(read_or_bisect(half, image, settled));
    }
  }
  return {};
}

void Client::remember(const PlannedRead& refused, const Error& error, RegisterImage& image) {
  for (const RegisterRange& range : refused.wanted) {
    Error located = error;
    located.register_address = range.first;
    image.fail(range, located);
    if (is_missing_register(error)) absent_.insert_or_assign(range, located);
  }
}

/// The refusal of a range that lies within this one.
const Error* Client::known_absent(const RegisterRange& range) const {
  const auto last =
      absent_.lower_bound({range.table, static_cast<std::uint16_t>(end_of(range) - 1), 0xFFFF});
  for (auto absent = absent_.lower_bound({range.table, range.first, 0}); absent != last; ++absent) {
    if (end_of(absent->first) <= end_of(range)) return &absent->second;
  }
  return nullptr;
}

void Client::avoid(const RegisterRange& range) {
  const std::uint32_t first = register_key(range.table, range.first);
  for (std::uint32_t key = first; key < first + range.count; ++key) avoided_.insert(key);
}

std::size_t Client::count_wanted(const std::vector<RegisterRange>& wanted) const {
  RegisterImage unused;
  return count_pieces(plan_reads(askable(wanted, unused), limits_, absent_registers()));
}

std::set<std::uint32_t> Client::absent_registers() const {
  std::set<std::uint32_t> registers = avoided_;
  for (const auto& [range, error] : absent_) {
    const std::uint32_t first = register_key(range.table, range.first);
    for (std::uint32_t key = first; key < first + range.count; ++key) registers.insert(key);
  }
  return registers;
}

Result<void> Client::write(const modbus::Pdu& request) {
  return ask(request, 0).map([](const modbus::Pdu&) {});
}

Result<Bytes> Client::report_server_id() {
  return believed([&] {
    return ask(modbus::report_server_id_request(), retries_).map([](const modbus::Pdu& response) {
      const ByteView data = modbus::server_id_of(response);
      return Bytes(data.begin(), data.end());
    });
  });
}

Result<void> Client::loopback(std::uint16_t word) {
  return ask(modbus::loopback_request(word), retries_).map([](const modbus::Pdu&) {});
}

}  // namespace spindle::link
