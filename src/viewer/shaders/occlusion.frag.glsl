// Ambient occlusion in screen space (McGuire and others 2012, "Scalable Ambient Obscurance").
uniform sampler2D depth_map;
uniform sampler2D normal_map;
in vec3 ray;
layout(location = 0) out vec4 result;

vec3 position(ivec2 pixel) {
  float z = texelFetch(depth_map, pixel, 0).r * 2.0 - 1.0;
  float near = ray_z.w, far = viewport.z;
  float forward = 2.0 * near * far / (far + near - z * (far - near));
  vec2 corner = (vec2(pixel) + 0.5) / viewport.xy * 2.0 - 1.0;
  return (ray_z.xyz + corner.x * ray_x.xyz + corner.y * ray_y.xyz) * forward;
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float depth = texelFetch(depth_map, pixel, 0).r;
  if (depth >= 0.99999) {
    result = vec4(1.0);
    return;
  }
  vec3 p = position(pixel);
  vec3 n = texelFetch(normal_map, pixel, 0).xyz;
  float radius = occlusion.x;
  float reach = clamp(radius / pixel_size(length(p)), 1.0, viewport.y * 0.25);
  float turn = 6.2831853 * fract(52.9829189 * fract(dot(vec2(pixel & 3), vec2(0.7548777, 0.5698403))));
  mat2 turned = mat2(cos(turn), sin(turn), -sin(turn), cos(turn));
  float samples = occlusion.y;
  float sum = 0.0;
  for (int i = 0; i < int(samples); ++i) {
    float r = (float(i) + 0.5) / samples;
    ivec2 other = pixel + ivec2(r * reach * (turned * taps[i].xy));
    if (any(lessThan(other, ivec2(0))) || any(greaterThanEqual(other, ivec2(viewport.xy)))) continue;
    vec3 v = position(other) - p;
    float vv = dot(v, v), vn = dot(v, n);
    float falloff = max(radius * radius - vv, 0.0) / (radius * radius);
    sum += falloff * falloff * falloff * max((vn - 0.02 * radius) / (vv + 0.01 * radius * radius), 0.0);
  }
  result = vec4(clamp(1.0 - 3.2 * sum * radius / samples, 0.0, 1.0));
}
