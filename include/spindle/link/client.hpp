#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "spindle/link/register_range.hpp"
#include "spindle/link/session.hpp"

namespace spindle::link {

/// Which registers may be read along for no other reason than to prove an answer.
enum class Neighbours : std::uint8_t {
  contiguous,  ///< those of contiguous areas
  anywhere,
};

/// Whether it is worth asking again on the same line: the answer was lost, or what came of it was
/// damaged.
bool is_lost_answer(const Error& error);

/// What a server allows, from the profile.
struct ReadLimits {
  std::uint16_t max_read = modbus::max_read_count;
  std::uint16_t max_read_bits = modbus::max_read_bits;  ///< of coils and discrete inputs
  /// Areas in which registers that were not asked for may be read along to save a request.
  std::vector<RegisterRange> contiguous = {};
  /// So many registers that were not asked for may be read along anywhere.
  std::uint16_t max_gap = 0;
  Neighbours neighbours = Neighbours::contiguous;
  /// Areas that are said not to exist, or that reading clears. What is wanted there shares a
  /// request with nothing but its own area, so that no other answer is spoilt and nothing is
  /// cleared unasked. A hole that is answered is there all the same; one that is refused with
  /// exception 02 is taken to be as was said.
  std::vector<RegisterRange> absent = {};
  /// Reads whose answers would look like a spontaneous frame; never issued.
  std::vector<RegisterRange> forbidden_shapes = {};  // table and count; `first` is ignored
  /// Where the server says, in a code of its own, why it sent its last exception response.
  std::optional<RegisterRange> refusal = std::nullopt;

  [[nodiscard]] std::uint16_t most_in_read(modbus::RegisterTable table) const {
    return modbus::holds_bits(table) ? max_read_bits : max_read;
  }
};

/// One request of a plan, and the wanted ranges whose registers its answer brings.
struct PlannedRead {
  RegisterRange range;
  std::vector<RegisterRange> wanted;  ///< ascending; the first begins and the last ends the range
};

/// Requests that cover all wanted ranges: none longer than the limit, none of the forbidden shape,
/// no wanted range split (a 32-bit pair stays in one answer) unless it alone is too long or
/// forbidden, gaps bridged only inside contiguous areas and never across `absent` registers. Pure.
std::vector<PlannedRead> plan_reads(const std::vector<RegisterRange>& wanted,
                                    const ReadLimits& limits,
                                    const std::set<std::uint32_t>& absent = {});

/// Reads of up to three more registers, as far as neighbours may be read, whose answers hold the
/// range, too. Pure.
std::vector<OtherRead> other_reads(const RegisterRange& range, const ReadLimits& limits,
                                   const std::set<std::uint32_t>& absent = {});

/// Key of one register in sets and maps.
constexpr std::uint32_t register_key(modbus::RegisterTable table, std::uint16_t address) {
  constexpr unsigned address_bits = 16;
  return (static_cast<std::uint32_t>(table) << address_bits) | address;
}

/// What reading many registers gave: a value, "absent" or an error for each.
class RegisterImage {
 public:
  void store(const RegisterRange& range, RegisterView values);
  void fail(const RegisterRange& range, const Error& error);
  /// All registers of the range, or the first error among them.
  [[nodiscard]] Result<Registers> get(const RegisterRange& range) const;

 private:
  std::map<std::uint32_t, std::uint16_t> values_;
  std::map<std::uint32_t, Error> errors_;
};

/// Hears how much of a long job is done.
using Progress = std::function<void(std::size_t done, std::size_t total)>;

/// Reads and writes within what the server allows. Only reads are repeated, and only when no answer
/// came, or a damaged one. On a serial line whose answers turn out to be others' while it reads,
/// all is read again, each answer proved.
class Client {
 public:
  Client(Session& session, ReadLimits limits, unsigned retries);

  /// One request (FC 01 to 04). An exception response becomes `exception_response` with its code,
  /// and with the device's own where the limits say where it stands: it is read right after it.
  Result<Registers> read(const RegisterRange& range);

  /// One request for what reading clears: never repeated, not even where no answer came. Needs
  /// answers with ids, as others may be proved by asking again.
  Result<Registers> read_once_ever(const RegisterRange& range);

  /// All wanted ranges in the fewest requests. A block that is refused with exception 02, 03 or 04
  /// is bisected, and what does not exist (02) is remembered and not asked for again. Exception
  /// responses stand in the image at the registers concerned; anything else ends it at once and is
  /// the result. `progress` hears how many of the wanted pieces are known by now, or known to be
  /// absent.
  Result<RegisterImage> read_each(const std::vector<RegisterRange>& wanted,
                                  const Progress& progress = {});

  /// A request that writes, sent once. Its answer proves nothing about the device's state.
  Result<void> write(const modbus::Pdu& request);

  /// FC 11h; the device-specific bytes.
  Result<Bytes> report_server_id();
  /// FC 08 00 with `word`.
  Result<void> loopback(std::uint16_t word);

  /// Never reads these registers along with others, because they are unlikely to exist.
  void avoid(const RegisterRange& range);

  /// How many pieces read_each() will tell its progress of.
  [[nodiscard]] std::size_t count_wanted(const std::vector<RegisterRange>& wanted) const;

  [[nodiscard]] Session& session() { return *session_; }

 private:
  Result<modbus::Pdu> ask(const modbus::Pdu& request, unsigned retries,
                          const std::vector<OtherRead>& others = {});
  Result<Registers> read_once(const RegisterRange& range);
  Result<RegisterImage> read_each_once(const std::vector<RegisterRange>& wanted,
                                       const Progress& progress);
  template <typename Read>
  auto believed(Read read) -> decltype(read());
  std::vector<RegisterRange> askable(const std::vector<RegisterRange>& wanted,
                                     RegisterImage& image) const;
  [[nodiscard]] std::optional<std::uint32_t> read_refusal();
  using Settled = std::function<void(const PlannedRead& part)>;
  Result<void> read_or_bisect(const PlannedRead& planned, RegisterImage& image,
                              const Settled& settled);
  void remember(const PlannedRead& refused, const Error& error, RegisterImage& image);
  [[nodiscard]] const Error* known_absent(const RegisterRange& range) const;
  [[nodiscard]] std::set<std::uint32_t> absent_registers() const;

  Session* session_;
  ReadLimits limits_;
  unsigned retries_;
  /// Ranges that were refused alone with exception 02. Of a refused pair it is not known which half
  /// is missing.
  std::map<RegisterRange, Error> absent_ = {};
  std::set<std::uint32_t> avoided_ = {};
};

}  // namespace spindle::link
