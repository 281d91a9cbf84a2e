// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "matching/onnx_model.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include <onnxruntime_session_options_config_keys.h>
#include <xxhash.h>

namespace topoloc::matching {
namespace {

/// ONNX Runtime's ready-made libraries report their use over the network, and keep an identifier of
/// the machine in the user's home, unless they are told not to before their environment is made.
Ort::Env silent_environment() {
  for (const char* const name : {"ORT_DISABLE_TELEMETRY", "ORT_TELEMETRY_DISABLED"}) {
    ::setenv(name, "1", 1);  // the name depends on the version
  }
  return {ORT_LOGGING_LEVEL_ERROR, "topoloc"};
}

Ort::Env& environment() {
  static Ort::Env env = silent_environment();  // one per process, by ONNX Runtime
  return env;
}

std::vector<char> read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    throw std::runtime_error(path.string() + ": cannot read this model file");
  }
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::string to_string(ONNXTensorElementDataType type) {
  switch (type) {
    case ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT:
      return "float32";
    case ONNX_TENSOR_ELEMENT_DATA_TYPE_DOUBLE:
      return "float64";
    case ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT16:
      return "float16";
    case ONNX_TENSOR_ELEMENT_DATA_TYPE_UINT8:
      return "uint8";
    case ONNX_TENSOR_ELEMENT_DATA_TYPE_INT32:
      return "int32";
    case ONNX_TENSOR_ELEMENT_DATA_TYPE_INT64:
      return "int64";
    default:
      return "of ONNX type " + std::to_string(static_cast<int>(type));
  }
}

/// "float32 1x1x384x640"; open sides as "?".
std::string to_string(ONNXTensorElementDataType type, const OnnxModel::Shape& shape) {
  std::string text = to_string(type);
  for (std::size_t i = 0; i < shape.size(); ++i) {
    text += (i == 0 ? " " : "x") +
            (shape[i] == OnnxModel::kAnySide ? std::string("?") : std::to_string(shape[i]));
  }
  return text + (shape.empty() ? " scalar" : "");
}

Ort::SessionOptions session_options(int threads, const std::string& execution_provider) {
  Ort::SessionOptions options;
  options.SetIntraOpNumThreads(threads);
  options.SetInterOpNumThreads(1);
  options.SetExecutionMode(ORT_SEQUENTIAL);
  options.SetGraphOptimizationLevel(ORT_ENABLE_ALL);
  options.SetDeterministicCompute(true);
  // Waiting threads sleep: the estimator needs the cores more than the network needs microseconds.
  options.AddConfigEntry(kOrtSessionOptionsConfigAllowIntraOpSpinning, "0");
  // Masked attention is full of denormals, each of which costs a microcode trap.
  options.AddConfigEntry(kOrtSessionOptionsConfigSetDenormalAsZero, "1");
  if (execution_provider == "cuda") {
    const std::vector<std::string> available = Ort::GetAvailableProviders();
    if (std::find(available.begin(), available.end(), "CUDAExecutionProvider") == available.end()) {
      throw std::runtime_error(
          "execution provider 'cuda': this ONNX Runtime was built without it; install the GPU "
          "build or set matching.execution_provider to 'cpu'");
    }
    options.AppendExecutionProvider_CUDA(OrtCUDAProviderOptions{});
  } else if (execution_provider != "cpu") {
    throw std::runtime_error("execution provider '" + execution_provider +
                             "' is not one of: cpu, cuda");
  }
  return options;
}

}  // namespace

OnnxModel::OnnxModel(const std::filesystem::path& path, int threads,
                     const std::string& execution_provider)
    : path_(path) {
  const std::vector<char> file = read_file(path);
  fingerprint_ = XXH3_64bits(file.data(), file.size());
  try {
    session_ = Ort::Session(environment(), file.data(), file.size(),
                            session_options(threads, execution_provider));
    inputs_ = describe(true);
    outputs_ = describe(false);
    binding_ = Ort::IoBinding(session_);
  } catch (const Ort::Exception& error) {
    throw std::runtime_error(path.string() + ": " + error.what());
  }
}

std::vector<OnnxModel::Tensor> OnnxModel::describe(bool inputs) const {
  Ort::AllocatorWithDefaultOptions allocator;
  const std::size_t count = inputs ? session_.GetInputCount() : session_.GetOutputCount();
  std::vector<Tensor> tensors;
  tensors.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    Tensor tensor;
    tensor.name = (inputs ? session_.GetInputNameAllocated(i, allocator)
                          : session_.GetOutputNameAllocated(i, allocator))
                      .get();
    // The type information owns the shape information: keep it alive.
    const Ort::TypeInfo type =
        inputs ? session_.GetInputTypeInfo(i) : session_.GetOutputTypeInfo(i);
    if (type.GetONNXType() != ONNX_TYPE_TENSOR) {
      throw std::runtime_error(path_.string() + ": '" + tensor.name + "' is not a tensor");
    }
    const auto info = type.GetTensorTypeAndShapeInfo();
    tensor.type = info.GetElementType();
    tensor.shape = info.GetShape();
    tensors.push_back(std::move(tensor));
  }
  return tensors;
}

std::size_t OnnxModel::find(bool inputs, const std::string& name) const {
  const std::vector<Tensor>& tensors = inputs ? inputs_ : outputs_;
  std::string names;
  for (std::size_t i = 0; i < tensors.size(); ++i) {
    if (tensors[i].name == name) {
      return i;
    }
    names += (names.empty() ? "" : ", ") + tensors[i].name;
  }
  throw std::runtime_error(path_.string() + ": the model has no " +
                           (inputs ? "input '" : "output '") + name + "', it has: " + names);
}

void OnnxModel::refuse(bool input, const Tensor& tensor, const std::string& expected) const {
  throw std::runtime_error(path_.string() + ": " + (input ? "input '" : "output '") + tensor.name +
                           "' is " + to_string(tensor.type, tensor.shape) + ", expected " +
                           expected);
}

OnnxModel::Tensor& OnnxModel::expect(bool inputs, const std::string& name,
                                     ONNXTensorElementDataType type, const Shape& shape) {
  Tensor& tensor = (inputs ? inputs_ : outputs_)[find(inputs, name)];
  // An open side of an input takes any size; one of an output could become anything.
  const auto fits = [inputs](std::int64_t stated, std::int64_t wanted) {
    return stated == wanted || (inputs ? stated : wanted) == kAnySide;
  };
  if (tensor.type != type ||
      !std::equal(tensor.shape.begin(), tensor.shape.end(), shape.begin(), shape.end(), fits)) {
    refuse(inputs, tensor, to_string(type, shape));
  }
  return tensor;
}

const OnnxModel::Tensor& OnnxModel::with_sides(bool inputs, const std::string& name,
                                               std::size_t sides) const {
  const Tensor& tensor = (inputs ? inputs_ : outputs_)[find(inputs, name)];
  if (tensor.shape.size() != sides) {
    refuse(inputs, tensor, std::to_string(sides) + " sides");
  }
  return tensor;
}

int OnnxModel::columns(bool inputs, const std::string& name) const {
  const Tensor& tensor = with_sides(inputs, name, 2);
  if (tensor.shape[1] < 1) {
    refuse(inputs, tensor, "a fixed number of columns");
  }
  return static_cast<int>(tensor.shape[1]);
}

bool OnnxModel::has_input(const std::string& name) const {
  return std::any_of(inputs_.begin(), inputs_.end(),
                     [&](const Tensor& tensor) { return tensor.name == name; });
}

const OnnxModel::Shape& OnnxModel::input_shape(const std::string& name, std::size_t sides) const {
  return with_sides(true, name, sides).shape;
}

int OnnxModel::input_columns(const std::string& name) const { return columns(true, name); }
int OnnxModel::output_columns(const std::string& name) const { return columns(false, name); }

std::span<float> OnnxModel::input(const std::string& name, const Shape& shape) {
  Tensor& tensor = expect(true, name, ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT, shape);
  tensor.value = Ort::Value::CreateTensor(Ort::AllocatorWithDefaultOptions(), shape.data(),
                                          shape.size(), tensor.type);
  binding_.BindInput(name.c_str(), tensor.value);
  return {tensor.value.GetTensorMutableData<float>(),
          tensor.value.GetTensorTypeAndShapeInfo().GetElementCount()};
}

template <typename T>
std::span<const T> OnnxModel::output(const std::string& name, const Shape& shape) {
  Tensor& tensor = expect(false, name, Ort::TypeToTensorType<T>::type, shape);
  tensor.value = Ort::Value::CreateTensor(Ort::AllocatorWithDefaultOptions(), shape.data(),
                                          shape.size(), tensor.type);
  binding_.BindOutput(name.c_str(), tensor.value);
  return {tensor.value.GetTensorData<T>(),
          tensor.value.GetTensorTypeAndShapeInfo().GetElementCount()};
}
template std::span<const float> OnnxModel::output<float>(const std::string&, const Shape&);
template std::span<const std::int32_t> OnnxModel::output<std::int32_t>(const std::string&,
                                                                       const Shape&);

void OnnxModel::expect_output(const std::string& name, const Shape& shape) {
  Tensor& tensor = expect(false, name, ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT, shape);
  tensor.variable = true;
  binding_.BindOutput(name.c_str(), Ort::MemoryInfo::CreateCpu(OrtArenaAllocator, OrtMemTypeCPU));
}

void OnnxModel::require_no_other_inputs() const {
  for (const Tensor& tensor : inputs_) {
    if (!tensor.value) {
      throw std::runtime_error(path_.string() + ": the model has an input '" + tensor.name + "' (" +
                               to_string(tensor.type, tensor.shape) +
                               "), expected none of this name");
    }
  }
}

void OnnxModel::run() {
  try {
    session_.Run(Ort::RunOptions{nullptr}, binding_);
    if (std::none_of(outputs_.begin(), outputs_.end(), [](const auto& t) { return t.variable; })) {
      return;  // all results are in the memory that was bound: no allocation
    }
    const std::vector<std::string> names = binding_.GetOutputNames();
    std::vector<Ort::Value> values = binding_.GetOutputValues();
    for (Tensor& tensor : outputs_) {
      if (tensor.variable) {
        const auto at = std::find(names.begin(), names.end(), tensor.name) - names.begin();
        tensor.value = std::move(values[static_cast<std::size_t>(at)]);
      }
    }
  } catch (const Ort::Exception& error) {
    throw std::runtime_error(path_.string() + ": " + error.what());
  }
}

std::span<const float> OnnxModel::result(const std::string& name) const {
  const Tensor& tensor = outputs_[find(false, name)];
  return {tensor.value.GetTensorData<float>(),
          tensor.value.GetTensorTypeAndShapeInfo().GetElementCount()};
}

}  // namespace topoloc::matching
