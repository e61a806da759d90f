#!/usr/bin/env python3
"""Writes perceptual_golden.h: FID features, LPIPS and the Fréchet distance of small networks in
float64, computed with numpy alone.

    tests/reference/perceptual_golden.py > tests/reference/perceptual_golden.h

Weights and pictures are functions of their names (tests/support/networks/named_values.h), so that
none are stored. Layers have the published names; channels are divided by 16.
"""
import sys

import numpy as np

DIVISOR = 16


def uniform(name, count):
    """NamedValue of tests/support/networks/named_values.h for 0..count-1."""
    code = 0xCBF29CE484222325
    for byte in name.encode():
        code = ((code ^ byte) * 0x100000001B3) & 0xFFFFFFFFFFFFFFFF
    with np.errstate(over="ignore"):
        x = np.uint64(code) + np.arange(count, dtype=np.uint64) + np.uint64(0x9E3779B97F4A7C15)
        x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        x = x ^ (x >> np.uint64(31))
    return (x >> np.uint64(40)).astype(np.float64) / 2.0**24


def stored(values):
    """As read from a weight file."""
    return values.astype(np.float32).astype(np.float64)


def array(name, shape, low, high):
    values = uniform(name, int(np.prod(shape))).reshape(shape)
    return stored(low + (high - low) * values)


def kernel(name, shape):
    bound = np.sqrt(6.0 / np.prod(shape[1:]))
    return array(name, shape, -bound, bound)


def picture(name, width, height):
    return stored(uniform(name, 3 * width * height)).reshape(3, height, width)


def convolve(x, weight, stride=1, padding=(0, 0)):
    x = np.pad(x, ((0, 0), (padding[0], padding[0]), (padding[1], padding[1])))
    rows = (x.shape[1] - weight.shape[2]) // stride + 1
    columns = (x.shape[2] - weight.shape[3]) // stride + 1
    out = np.zeros((weight.shape[0], rows, columns))
    for dy in range(weight.shape[2]):
        for dx in range(weight.shape[3]):
            part = x[:, dy:dy + stride * rows:stride, dx:dx + stride * columns:stride]
            out += np.tensordot(weight[:, :, dy, dx], part[:, :rows, :columns], axes=1)
    return out


def max_pool(x, size, stride, padding=0):
    x = np.pad(x, ((0, 0), (padding, padding), (padding, padding)), constant_values=-np.inf)
    rows, columns = ((n - size) // stride + 1 for n in x.shape[1:])
    return np.max([x[:, dy:dy + stride * rows:stride, dx:dx + stride * columns:stride]
                   [:, :rows, :columns] for dy in range(size) for dx in range(size)], axis=0)


def mean_pool(x, within_picture):
    ones = np.ones((1,) + x.shape[1:])
    def total(y):
        y = np.pad(y, ((0, 0), (1, 1), (1, 1)))
        return sum(y[:, dy:dy + x.shape[1], dx:dx + x.shape[2]]
                   for dy in range(3) for dx in range(3))
    return total(x) / (total(ones) if within_picture else 9.0)


def stretch(x, side):
    """Bilinear, corners not aligned, no antialiasing."""
    def weights(size):
        at = np.maximum((np.arange(side) + 0.5) * size / side - 0.5, 0.0)
        first = np.minimum(at.astype(int), size - 1)
        matrix = np.zeros((side, size))
        matrix[np.arange(side), first] += 1.0 - (at - first)
        matrix[np.arange(side), np.minimum(first + 1, size - 1)] += at - first
        return matrix
    return np.einsum("ay,cyx,bx->cab", weights(x.shape[1]), x, weights(x.shape[2]))


def unit(x, name, out, height, width, stride=1, valid=False):
    """Convolution, batch norm, ReLU; `out` as published."""
    out //= DIVISOR
    padding = (0, 0) if valid else (height // 2, width // 2)
    y = convolve(x, kernel(name + ".conv.weight", (out, x.shape[0], height, width)), stride, padding)
    gain, offset, mean, variance = (
        array(name + ".bn." + part, (out,), low, high)[:, None, None]
        for part, low, high in (("weight", 0.8, 1.2), ("bias", -0.2, 0.2),
                                ("running_mean", -0.2, 0.2), ("running_var", 0.5, 1.5)))
    return np.maximum((y - mean) / np.sqrt(variance + 1e-3) * gain + offset, 0.0)


def chain(x, block, *layers):
    for name, *shape in layers:
        x = unit(x, block + "." + name, *shape)
    return x


def inception(x, fid):
    x = 2.0 * stretch(x, 299) - 1.0
    x = unit(x, "Conv2d_1a_3x3", 32, 3, 3, 2, True)
    x = unit(x, "Conv2d_2a_3x3", 32, 3, 3, 1, True)
    x = max_pool(unit(x, "Conv2d_2b_3x3", 64, 3, 3), 3, 2)
    x = unit(x, "Conv2d_3b_1x1", 80, 1, 1)
    x = max_pool(unit(x, "Conv2d_4a_3x3", 192, 3, 3, 1, True), 3, 2)
    for block, pooled in (("Mixed_5b", 32), ("Mixed_5c", 64), ("Mixed_5d", 64)):
        x = np.concatenate([
            chain(x, block, ("branch1x1", 64, 1, 1)),
            chain(x, block, ("branch5x5_1", 48, 1, 1), ("branch5x5_2", 64, 5, 5)),
            chain(x, block, ("branch3x3dbl_1", 64, 1, 1), ("branch3x3dbl_2", 96, 3, 3),
                  ("branch3x3dbl_3", 96, 3, 3)),
            chain(mean_pool(x, fid), block, ("branch_pool", pooled, 1, 1))])
    x = np.concatenate([
        chain(x, "Mixed_6a", ("branch3x3", 384, 3, 3, 2, True)),
        chain(x, "Mixed_6a", ("branch3x3dbl_1", 64, 1, 1), ("branch3x3dbl_2", 96, 3, 3),
              ("branch3x3dbl_3", 96, 3, 3, 2, True)),
        max_pool(x, 3, 2)])
    for block, inner in (("Mixed_6b", 128), ("Mixed_6c", 160), ("Mixed_6d", 160),
                         ("Mixed_6e", 192)):
        x = np.concatenate([
            chain(x, block, ("branch1x1", 192, 1, 1)),
            chain(x, block, ("branch7x7_1", inner, 1, 1), ("branch7x7_2", inner, 1, 7),
                  ("branch7x7_3", 192, 7, 1)),
            chain(x, block, ("branch7x7dbl_1", inner, 1, 1), ("branch7x7dbl_2", inner, 7, 1),
                  ("branch7x7dbl_3", inner, 1, 7), ("branch7x7dbl_4", inner, 7, 1),
                  ("branch7x7dbl_5", 192, 1, 7)),
            chain(mean_pool(x, fid), block, ("branch_pool", 192, 1, 1))])
    x = np.concatenate([
        chain(x, "Mixed_7a", ("branch3x3_1", 192, 1, 1), ("branch3x3_2", 320, 3, 3, 2, True)),
        chain(x, "Mixed_7a", ("branch7x7x3_1", 192, 1, 1), ("branch7x7x3_2", 192, 1, 7),
              ("branch7x7x3_3", 192, 7, 1), ("branch7x7x3_4", 192, 3, 3, 2, True)),
        max_pool(x, 3, 2)])
    for block in ("Mixed_7b", "Mixed_7c"):
        middle = chain(x, block, ("branch3x3_1", 384, 1, 1))
        wide = chain(x, block, ("branch3x3dbl_1", 448, 1, 1), ("branch3x3dbl_2", 384, 3, 3))
        pooled = max_pool(x, 3, 1, 1) if fid and block == "Mixed_7c" else mean_pool(x, fid)
        x = np.concatenate([
            chain(x, block, ("branch1x1", 320, 1, 1)),
            chain(middle, block, ("branch3x3_2a", 384, 1, 3)),
            chain(middle, block, ("branch3x3_2b", 384, 3, 1)),
            chain(wide, block, ("branch3x3dbl_3a", 384, 1, 3)),
            chain(wide, block, ("branch3x3dbl_3b", 384, 3, 1)),
            chain(pooled, block, ("branch_pool", 192, 1, 1))])
    return x.mean(axis=(1, 2))


# Number in torchvision's `features`, channels, kernel, stride, padding; "pool" and "compare".
ALEXNET = [(0, 64, 11, 4, 2), "compare", "pool", (3, 192, 5, 1, 2), "compare", "pool",
           (6, 384, 3, 1, 1), "compare", (8, 256, 3, 1, 1), "compare", (10, 256, 3, 1, 1),
           "compare"]
VGG = [(0, 64), (2, 64), "compare", "pool", (5, 128), (7, 128), "compare", "pool", (10, 256),
       (12, 256), (14, 256), "compare", "pool", (17, 512), (19, 512), (21, 512), "compare", "pool",
       (24, 512), (26, 512), (28, 512), "compare"]


def lpips(name, steps, pool, one, other):
    shift = np.array([-0.030, -0.088, -0.188])[:, None, None]
    scale = np.array([0.458, 0.448, 0.450])[:, None, None]
    x = [(2.0 * p - 1.0 - shift) / scale for p in (one, other)]
    distance, compared = 0.0, 0
    for step in steps:
        if step == "pool":
            x = [max_pool(y, pool, 2) for y in x]
        elif step == "compare":
            unit_length = [y / (np.sqrt((y * y).sum(axis=0)) + 1e-10) for y in x]
            weight = array(f"{name}.lin{compared}.model.1.weight", x[0].shape[:1], 0.0, 1.0)
            squares = (unit_length[0] - unit_length[1]) ** 2
            distance += (weight[:, None, None] * squares).sum(axis=0).mean()
            compared += 1
        else:
            number, out, size, stride, padding = step if len(step) > 2 else (*step, 3, 1, 1)
            layer = f"{name}.features.{number}."
            out //= DIVISOR
            weight = kernel(layer + "weight", (out, x[0].shape[0], size, size))
            bias = array(layer + "bias", (out,), -0.2, 0.2)[:, None, None]
            x = [np.maximum(convolve(y, weight, stride, (padding, padding)) + bias, 0.0) for y in x]
    return distance


def samples(name, count, width):
    """Features that depend on each other: each is half of the one before."""
    values = uniform(name, count * width).reshape(count, width)
    for k in range(1, width):
        values[:, k] += 0.5 * values[:, k - 1]
    return stored(values)


def frechet(first, second):
    """By eigenvalues of the product, which is not symmetric."""
    c1, c2 = np.cov(first.T), np.cov(second.T)
    roots = np.sqrt(np.maximum(np.linalg.eigvals(c1 @ c2).real, 0.0))
    difference = first.mean(axis=0) - second.mean(axis=0)
    return difference @ difference + np.trace(c1) + np.trace(c2) - 2.0 * roots.sum()


def main():
    x = picture("picture", 120, 90)
    one, other = picture("one", 80, 72), picture("other", 80, 72)
    print("// Written by perceptual_golden.py.\n#pragma once\n\nnamespace color3d {\n")
    for name, fid in (("Fid", True), ("Torchvision", False)):
        values = ", ".join(f"{v:.9g}" for v in inception(x, fid))
        print(f"inline constexpr double k{name}Features[] = {{{values}}};")
    print(f"inline constexpr double kAlexNetLpips = {lpips('alex', ALEXNET, 3, one, other):.12g};")
    print(f"inline constexpr double kVggLpips = {lpips('vgg', VGG, 2, one, other):.12g};")
    many = frechet(samples("fid.first", 40, 6), samples("fid.second", 50, 6))
    few = frechet(samples("fid.first", 5, 6), samples("fid.second", 4, 6))
    print(f"inline constexpr double kFrechetOfMany = {many:.12g};")
    print(f"inline constexpr double kFrechetOfFew = {few:.12g};")
    print("\n}  // namespace color3d")
    return 0


if __name__ == "__main__":
    sys.exit(main())
