// The functions of spherical_harmonics.h, as text without a namespace: that header includes them
// once, the kernels once per instruction set (after that header, whose constants they use).

// basis[k] for k < coefficients (1, 4, 9 or 16); (x, y, z) is a unit vector.
template <class T>
inline void EvaluateSh(int coefficients, T x, T y, T z, T* basis) {
  basis[0] = x * 0.0f + kShDc;
  if (coefficients <= 1) return;
  basis[1] = y * -0.4886025119029199f;
  basis[2] = z * 0.4886025119029199f;
  basis[3] = x * -0.4886025119029199f;
  if (coefficients <= 4) return;
  const T xx = x * x, yy = y * y, zz = z * z;
  basis[4] = x * y * 1.0925484305920792f;
  basis[5] = y * z * -1.0925484305920792f;
  basis[6] = (zz + zz - xx - yy) * 0.31539156525252005f;
  basis[7] = x * z * -1.0925484305920792f;
  basis[8] = (xx - yy) * 0.5462742152960396f;
  if (coefficients <= 9) return;
  basis[9] = y * (xx * 3.0f - yy) * -0.5900435899266435f;
  basis[10] = x * y * z * 2.890611442640554f;
  basis[11] = y * (zz * 4.0f - xx - yy) * -0.4570457994644658f;
  basis[12] = z * (zz * 2.0f - xx * 3.0f - yy * 3.0f) * 0.3731763325901154f;
  basis[13] = x * (zz * 4.0f - xx - yy) * -0.4570457994644658f;
  basis[14] = z * (xx - yy) * 1.445305721320277f;
  basis[15] = x * (xx - yy * 3.0f) * -0.5900435899266435f;
}

// Gradient by (x, y, z) of sum over k of weight[k] * basis[k] (as polynomials in x, y, z).
template <class T>
inline void ShGradient(int coefficients, T x, T y, T z, const T* weight, T* gradient) {
  T gx = x * 0.0f, gy = x * 0.0f, gz = x * 0.0f;
  if (coefficients > 1) {
    gx = gx - weight[3] * 0.4886025119029199f;
    gy = gy - weight[1] * 0.4886025119029199f;
    gz = gz + weight[2] * 0.4886025119029199f;
  }
  if (coefficients > 4) {
    const T w4 = weight[4] * 1.0925484305920792f, w5 = weight[5] * -1.0925484305920792f;
    const T w6 = weight[6] * 0.6307831305050401f, w7 = weight[7] * -1.0925484305920792f;
    const T w8 = weight[8] * 1.0925484305920792f;
    gx = gx + w4 * y - w6 * x + w7 * z + w8 * x;
    gy = gy + w4 * x + w5 * z - w6 * y - w8 * y;
    gz = gz + w5 * y + w6 * z * 2.0f + w7 * x;
  }
  if (coefficients > 9) {
    const T xx = x * x, yy = y * y, zz = z * z, xy = x * y, yz = y * z, xz = x * z;
    const T w9 = weight[9] * -0.5900435899266435f, w10 = weight[10] * 2.890611442640554f;
    const T w11 = weight[11] * -0.4570457994644658f, w12 = weight[12] * 0.3731763325901154f;
    const T w13 = weight[13] * -0.4570457994644658f, w14 = weight[14] * 1.445305721320277f;
    const T w15 = weight[15] * -0.5900435899266435f;
    gx = gx + w9 * xy * 6.0f + w10 * yz - w11 * xy * 2.0f - w12 * xz * 6.0f +
         w13 * (zz * 4.0f - xx * 3.0f - yy) + w14 * xz * 2.0f + w15 * (xx - yy) * 3.0f;
    gy = gy + w9 * (xx - yy) * 3.0f + w10 * xz + w11 * (zz * 4.0f - xx - yy * 3.0f) -
         w12 * yz * 6.0f - w13 * xy * 2.0f - w14 * yz * 2.0f - w15 * xy * 6.0f;
    gz = gz + w10 * xy + w11 * yz * 8.0f + w12 * (zz * 2.0f - xx - yy) * 3.0f + w13 * xz * 8.0f +
         w14 * (xx - yy);
  }
  gradient[0] = gx;
  gradient[1] = gy;
  gradient[2] = gz;
}
