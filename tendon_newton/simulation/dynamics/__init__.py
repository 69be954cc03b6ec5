"""The equations of motion inside kernels: forces, contact states, events and the integrator."""
