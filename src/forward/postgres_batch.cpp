#include "postgres_batch.hpp"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "spindle/base/decimal.hpp"
#include "spindle/base/utf8.hpp"
#include "spindle/report/record.hpp"

namespace spindle::forward {

const char* const insert_events = R"(
INSERT INTO spindle_event (maker, serial, epoch, number, at, tool_time, place, kind, source,
  remembered, preset, target_torque, torque, torque_unit, a1, a2, a3, error, barcode, payload, raw,
  remark, fence, collector_id, collector)
SELECT given.*, $25::text FROM unnest($1::text[], $2::text[], $3::int[], $4::int[],
  $5::timestamptz[], $6::timestamptz[], $7::text[], $8::text[], $9::text[], $10::bool[],
  $11::bigint[], $12::numeric[], $13::numeric[], $14::text[], $15::bigint[], $16::bigint[],
  $17::bigint[], $18::bigint[], $19::text[], $20::jsonb[], $21::bytea[], $22::text[],
  $23::bigint[], $24::bigint[]) AS given
ON CONFLICT DO NOTHING RETURNING collector_id)";

const char* const compare_events = R"(
SELECT given.id, kept.raw IS NOT NULL, kept.raw IS DISTINCT FROM given.raw
FROM unnest($1::text[], $2::text[], $3::int[], $4::int[], $5::bytea[], $6::bigint[])
  AS given (maker, serial, epoch, number, raw, id)
LEFT JOIN spindle_event AS kept USING (maker, serial, epoch, number))";

const char* const insert_gaps = R"(
INSERT INTO spindle_gap (maker, serial, epoch, after, before, missed, at_least, began, ended, place,
  reason, payload, remark, collector_id, collector)
SELECT given.*, $15::text FROM unnest($1::text[], $2::text[], $3::int[], $4::int[], $5::int[],
  $6::bigint[], $7::bool[], $8::timestamptz[], $9::timestamptz[], $10::text[], $11::text[],
  $12::jsonb[], $13::text[], $14::bigint[]) AS given
ON CONFLICT DO NOTHING)";

const char* const insert_happenings = R"(
INSERT INTO spindle_happening (maker, serial, place, at, type, payload, remark, collector_id,
  collector)
SELECT given.*, $9::text FROM unnest($1::text[], $2::text[], $3::text[], $4::timestamptz[],
  $5::text[], $6::jsonb[], $7::text[], $8::bigint[]) AS given
ON CONFLICT DO NOTHING)";

const char* const insert_conflict = R"(
INSERT INTO spindle_conflict (key, what, reason, payload, raw, collector, collector_id)
VALUES ($1, $2, $3, $4, $5::bytea, $6, $7::bigint)
ON CONFLICT DO NOTHING RETURNING key)";

namespace {

/// U+0000 as append_json_string() writes it.
constexpr std::string_view json_nul = "\\u0000";
constexpr std::string_view json_replacement = "\\ufffd";

CleanText cleaned_reason(const store::Gap& gap) { return clean_text(gap.reason); }

}  // namespace

void PostgresArray::separate() {
  if (text_.size() > 1) text_ += ',';
}

void PostgresArray::add(std::string_view text) {
  separate();
  text_ += '"';
  for (const char c : text) {
    if (c == '"' || c == '\\') text_ += '\\';
    text_ += c;
  }
  text_ += '"';
}

void PostgresArray::add(std::int64_t number) {
  separate();
  text_ += fmt::format("{}", number);
}

void PostgresArray::add(bool truth) {
  separate();
  text_ += truth ? 't' : 'f';
}

void PostgresArray::add(WallTime time) { add(std::string_view(report::to_text(time))); }

void PostgresArray::add_bytes(RegisterView registers) {
  separate();
  text_ += "\"\\\\x";
  for (const std::uint16_t word : registers) text_ += fmt::format("{:04x}", word);
  text_ += '"';
}

void PostgresArray::add_torque(const std::optional<std::int64_t>& steps) {
  constexpr int exponent = -4;
  if (!steps) return add_null();
  static_assert(store::torque_scale == 10'000);
  separate();
  text_ += Decimal(*steps, exponent).to_string();
}

void PostgresArray::add_null() {
  separate();
  text_ += "NULL";
}

void PostgresArray::add_text_or_null(std::string_view text) {
  text.empty() ? add_null() : add(text);
}

CleanText clean_text(std::string_view text) {
  CleanText clean;
  clean.text.reserve(text.size());
  while (!text.empty()) {
    const CodePoint first = first_code_point(text);
    const std::string_view bytes = text.substr(0, first.length);
    if (first.well_formed && first.value != 0) {
      clean.text += bytes;
    } else {
      clean.is_changed = true;
      for (const char byte : bytes) {
        clean.text += fmt::format("\\x{:02X}", static_cast<unsigned char>(byte));
      }
    }
    text.remove_prefix(first.length);
  }
  return clean;
}

CleanText clean_json(std::string_view json) {
  CleanText clean;
  clean.text.reserve(json.size());
  for (std::size_t at = 0; at < json.size();) {
    if (json.substr(at, json_nul.size()) == json_nul) {
      clean.text += json_replacement;
      clean.is_changed = true;
      at += json_nul.size();
    } else {
      // An escaped backslash and what stands behind it are two things.
      const std::size_t size = json[at] == '\\' ? 2 : 1;
      clean.text += json.substr(at, size);
      at += size;
    }
  }
  return clean;
}

std::string remark_on(const Parcel& parcel) {
  bool is_changed =
      clean_json(parcel.json).is_changed || clean_text(parcel.tool.serial).is_changed ||
      clean_text(parcel.tool.maker).is_changed || clean_text(parcel.target).is_changed;
  if (const auto* event = parcel.event()) {
    is_changed = is_changed || clean_text(event->barcode).is_changed;
  }
  if (const auto* gap = parcel.gap()) is_changed = is_changed || cleaned_reason(*gap).is_changed;
  return is_changed ? "a text holds bytes that a database cannot keep: they stand as \\xHH, in the "
                      "payload as U+FFFD"
                    : "";
}

std::vector<std::optional<std::string>> event_values(std::span<const Parcel* const> parcels,
                                                     const std::string& collector) {
  std::array<PostgresArray, 24> all;
  for (const Parcel* parcel : parcels) {
    const store::Event& event = *parcel->event();
    const auto& columns = event.columns;
    std::size_t at = 0;
    const auto next = [&]() -> PostgresArray& { return all[at++]; };
    next().add(clean_text(parcel->tool.maker).text);
    next().add(clean_text(parcel->tool.serial).text);
    next().add(parcel->epoch);
    next().add(std::int64_t{event.number});
    next().add(event.at);
    next().add(event.tool_time);
    next().add(clean_text(parcel->target).text);
    next().add(clean_text(event.kind).text);
    next().add(clean_text(event.source).text);
    next().add(event.remembered);
    next().add(columns[store::Column::preset]);
    next().add_torque(columns[store::Column::target_torque]);
    next().add_torque(columns[store::Column::torque]);
    next().add_text_or_null(clean_text(parcel->torque_unit).text);
    for (const auto column :
         {store::Column::a1, store::Column::a2, store::Column::a3, store::Column::error}) {
      next().add(columns[column]);
    }
    next().add_text_or_null(clean_text(event.barcode).text);
    next().add(clean_json(parcel->json).text);
    next().add_bytes(event.raw);
    next().add_text_or_null(remark_on(*parcel));
    next().add(parcel->fence);
    next().add(parcel->id);
  }
  std::vector<std::optional<std::string>> values;
  for (PostgresArray& array : all) values.emplace_back(std::move(array).take());
  values.emplace_back(collector);
  return values;
}

std::vector<std::optional<std::string>> gap_values(std::span<const Parcel* const> parcels,
                                                   const std::string& collector) {
  std::array<PostgresArray, 14> all;
  const auto as_number = [](const auto& value) {
    return value ? std::optional<std::int64_t>(*value) : std::nullopt;
  };
  for (const Parcel* parcel : parcels) {
    const store::Gap& gap = *parcel->gap();
    std::size_t at = 0;
    const auto next = [&]() -> PostgresArray& { return all[at++]; };
    next().add(clean_text(parcel->tool.maker).text);
    next().add(clean_text(parcel->tool.serial).text);
    next().add(parcel->epoch);
    next().add(as_number(gap.after));
    next().add(as_number(gap.before));
    next().add(as_number(gap.missed));
    next().add(gap.at_least);
    next().add(gap.began);
    next().add(gap.ended);
    next().add(clean_text(parcel->target).text);
    next().add(cleaned_reason(gap).text);
    next().add(clean_json(parcel->json).text);
    next().add_text_or_null(remark_on(*parcel));
    next().add(parcel->id);
  }
  std::vector<std::optional<std::string>> values;
  for (PostgresArray& array : all) values.emplace_back(std::move(array).take());
  values.emplace_back(collector);
  return values;
}

std::vector<std::optional<std::string>> happening_values(std::span<const Parcel* const> parcels,
                                                         const std::string& collector) {
  std::array<PostgresArray, 8> all;
  for (const Parcel* parcel : parcels) {
    std::size_t at = 0;
    const auto next = [&]() -> PostgresArray& { return all[at++]; };
    next().add_text_or_null(clean_text(parcel->tool.maker).text);
    next().add_text_or_null(clean_text(parcel->tool.serial).text);
    next().add(clean_text(parcel->target).text);
    next().add(parcel->at);
    next().add(clean_text(parcel->happening()->type).text);
    next().add(clean_json(parcel->json).text);
    next().add_text_or_null(remark_on(*parcel));
    next().add(parcel->id);
  }
  std::vector<std::optional<std::string>> values;
  for (PostgresArray& array : all) values.emplace_back(std::move(array).take());
  values.emplace_back(collector);
  return values;
}

}  // namespace spindle::forward
