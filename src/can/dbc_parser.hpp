// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/dbc.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace topoloc::can {

/// One pass over the text of a DBC file. Statements are recognised by the keyword they start with;
/// messages and signals end with their line, all others with a semicolon outside of a string.
class DbcParser {
 public:
  DbcParser(std::string_view text, const std::string& name) : text_(text), name_(name) {}
  std::vector<Message> parse();

 private:
  struct Multiplexing {  ///< what "M" and "m3" said, resolved when the message is complete
    bool selected = false;
    std::uint64_t value = 0;
    int line = 0;
  };

  [[noreturn]] void fail(const std::string& what) const;
  [[noreturn]] void fail_at(int line, const std::string& what) const;

  // Lexical level.
  [[nodiscard]] bool at_end() const { return position_ >= text_.size(); }
  [[nodiscard]] char peek() const { return at_end() ? '\0' : text_[position_]; }
  void advance();      ///< counts lines
  void skip_blanks();  ///< within the line
  void skip_space();   ///< over line ends too
  void skip_line();
  void skip_statement(std::string_view keyword);
  bool accept(char c);
  void expect(char c, std::string_view where);
  std::string_view word();
  std::string_view expect_word(std::string_view what);
  double expect_number(std::string_view what);
  std::uint64_t expect_unsigned(std::string_view what, std::uint64_t most);
  std::string expect_string(std::string_view what);

  // Statements.
  void parse_message();
  void parse_signal();
  void parse_multiplexing(std::string_view token, Signal& signal, Multiplexing& multiplexing);
  void parse_value_type();
  void parse_multiplex_values();
  void parse_value_names();
  void skip_keyword_list();
  void skip_node_list();
  void resolve_multiplexing(std::size_t message_index);
  /// "ID SIGNAL" of the statements behind the messages; null where files refer to nothing.
  Signal* expect_signal(std::size_t& message_index);

  std::string_view text_;
  const std::string& name_;
  std::size_t position_ = 0;
  int line_ = 1;
  std::vector<Message> messages_;
  std::vector<std::vector<Multiplexing>> multiplexing_;   ///< parallel to messages_ and signals
  std::unordered_map<std::uint32_t, std::size_t> by_id_;  ///< key as in the file, bit 31 included
};

}  // namespace topoloc::can
