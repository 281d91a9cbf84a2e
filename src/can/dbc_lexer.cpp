// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "can/dbc_parser.hpp"

#include <charconv>
#include <stdexcept>

// The lexical half of DbcParser.
namespace topoloc::can {
namespace {

bool is_word_character(char c) {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
}

bool is_number_character(char c) {
  return (c >= '0' && c <= '9') || c == '+' || c == '-' || c == '.' || c == 'e' || c == 'E';
}

}  // namespace

void DbcParser::fail(const std::string& what) const { fail_at(line_, what); }

void DbcParser::fail_at(int line, const std::string& what) const {
  throw std::runtime_error(name_ + ":" + std::to_string(line) + ": " + what);
}

void DbcParser::advance() {
  line_ += text_[position_] == '\n' ? 1 : 0;
  ++position_;
}

void DbcParser::skip_blanks() {
  while (peek() == ' ' || peek() == '\t' || peek() == '\r') {
    advance();
  }
}

void DbcParser::skip_space() {
  while (peek() == ' ' || peek() == '\t' || peek() == '\r' || peek() == '\n') {
    advance();
  }
}

void DbcParser::skip_line() {
  while (!at_end() && peek() != '\n') {
    advance();
  }
}

void DbcParser::skip_statement(std::string_view keyword) {
  const int first_line = line_;
  for (bool in_string = false; !at_end(); advance()) {
    if (in_string && peek() == '\\') {
      advance();  // an escaped quote does not end the string
      if (at_end()) {
        break;
      }
    } else if (peek() == '"') {
      in_string = !in_string;
    } else if (peek() == ';' && !in_string) {
      advance();
      return;
    }
  }
  fail_at(first_line, "statement '" + std::string(keyword) + "' has no closing ';'");
}

bool DbcParser::accept(char c) {
  skip_blanks();
  if (at_end() || peek() != c) {
    return false;
  }
  advance();
  return true;
}

void DbcParser::expect(char c, std::string_view where) {
  if (!accept(c)) {
    fail("expected '" + std::string(1, c) + "' " + std::string(where));
  }
}

std::string_view DbcParser::word() {
  skip_blanks();
  const std::size_t first = position_;
  while (!at_end() && is_word_character(peek())) {
    advance();
  }
  return text_.substr(first, position_ - first);
}

std::string_view DbcParser::expect_word(std::string_view what) {
  const std::string_view found = word();
  if (found.empty()) {
    fail("expected " + std::string(what));
  }
  return found;
}

double DbcParser::expect_number(std::string_view what) {
  skip_blanks();
  const std::size_t first = position_;
  while (!at_end() && is_number_character(peek())) {
    advance();
  }
  std::string_view token = text_.substr(first, position_ - first);
  const std::string shown(token);
  if (token.starts_with('+')) {
    token.remove_prefix(1);  // from_chars takes no plus
  }
  double number = 0.0;
  const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), number);
  if (error != std::errc{} || end != token.data() + token.size()) {
    fail("expected " + std::string(what) + ", found '" + shown + "'");
  }
  return number;
}

std::uint64_t DbcParser::expect_unsigned(std::string_view what, std::uint64_t most) {
  skip_blanks();
  std::uint64_t number = 0;
  const char* first = text_.data() + position_;
  const auto [end, error] = std::from_chars(first, text_.data() + text_.size(), number);
  if (error != std::errc{} || number > most) {
    fail("expected " + std::string(what) + ", a whole number up to " + std::to_string(most));
  }
  position_ += static_cast<std::size_t>(end - first);
  return number;
}

std::string DbcParser::expect_string(std::string_view what) {
  expect('"', "before " + std::string(what));
  const int first_line = line_;
  std::string value;
  while (!at_end() && peek() != '"') {
    if (peek() == '\\' && position_ + 1 < text_.size()) {
      advance();
    }
    value += peek();
    advance();
  }
  if (at_end()) {
    fail_at(first_line, std::string(what) + " has no closing quote");
  }
  advance();
  return value;
}

}  // namespace topoloc::can
