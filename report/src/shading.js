// Eye-dome lighting (Boucheny 2009): points get darker where their neighbours on the screen are nearer to the eye, so that a cloud without
// normals shows its shape.
import * as THREE from 'three';

const compose = {
  vertexShader: `
    varying vec2 at;
    void main() {
      at = uv;
      gl_Position = vec4(position.xy, 0.0, 1.0);
    }`,
  fragmentShader: `
    uniform sampler2D colour, depth;
    uniform vec2 pixel;
    uniform float near, far, strength;
    varying vec2 at;
    // Distances are compared as logarithms: the same shape looks the same from near and far.
    float distance_at(vec2 p) {
      float z = texture2D(depth, p).x;
      return z >= 1.0 ? 0.0 : log2(near * far / (far - z * (far - near)));
    }
    void main() {
      vec4 seen = texture2D(colour, at);
      float here = texture2D(depth, at).x;
      float mine = distance_at(at), sum = 0.0;
      if (here < 1.0) {
        for (int k = 0; k < 8; ++k) {
          float angle = float(k) * 0.7853982;
          vec2 other = at + pixel * vec2(cos(angle), sin(angle));
          if (texture2D(depth, other).x < 1.0) sum += clamp(mine - distance_at(other), 0.0, 0.06);
        }
      }
      gl_FragColor = vec4(seen.rgb * exp(-strength * sum / 8.0), 1.0);
    }`,
};

export class Shading {
  /** `samples` a pixel: a sharp screen needs one. */
  constructor(renderer, samples) {
    this.renderer = renderer;
    this.target = new THREE.WebGLRenderTarget(4, 4, {samples, depthTexture: new THREE.DepthTexture(4, 4)});
    this.material = new THREE.ShaderMaterial({
      ...compose,
      depthTest: false,
      depthWrite: false,
      uniforms: {
        colour: {value: this.target.texture},
        depth: {value: this.target.depthTexture},
        pixel: {value: new THREE.Vector2()},
        near: {value: 1},
        far: {value: 2},
        strength: {value: 40},
      },
    });
    this.scene = new THREE.Scene();
    const all = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), this.material);
    all.frustumCulled = false;
    this.scene.add(all);
    this.camera = new THREE.Camera();
  }

  resize(width, height) {
    this.target.setSize(width, height);
    this.material.uniforms.pixel.value.set(1.4 / width, 1.4 / height);
  }

  render(scene, camera) {
    this.material.uniforms.near.value = camera.near;
    this.material.uniforms.far.value = camera.far;
    this.renderer.setRenderTarget(this.target);
    this.renderer.clear();
    this.renderer.render(scene, camera);
    this.renderer.setRenderTarget(null);
    this.renderer.render(this.scene, this.camera);
  }
}
