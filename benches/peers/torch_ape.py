# What it is compared with: PG-APE the usual way, environments stepped in NumPy, 64 at once, and the loss in PyTorch on the
# processor. The same work per update as our default run. It does 100 updates and prints what 732 would take.
# `cargo xtask bench peers` installs both and runs it.
import numpy as np, time
W=10;S=100;A=5;N=2;T=100;E=64;L=64;B=0.6;G=0.99
import torch
torch.set_num_threads(2)
nx=np.zeros((S,A),np.int64)
for s in range(S):
    r,c=divmod(s,W); nx[s]=[s-W if r>0 else s,s+W if r<9 else s,s-1 if c>0 else s,s+1 if c<9 else s,s]
rng=np.random.default_rng(0)
def roll(P,uniform):
    cum=P.cumsum(-1); s=rng.integers(1,S,E); c=rng.integers(0,N,E); t=np.zeros(E,int)
    so,ao,co,do=[],[],[],[]
    for _ in range(L):
        cc=rng.integers(0,N,E) if uniform else c
        a=np.minimum((rng.random(E)[:,None]>cum[cc,s]).sum(1),A-1); s2=nx[s,a]; t=t+1; done=(s2==0)|(t>=T)
        so.append(s);ao.append(a);co.append(cc);do.append(done)
        s=np.where(done,rng.integers(1,S,E),s2); c=np.where(done,rng.integers(0,N,E),c); t=np.where(done,0,t)
    so,ao,co,do=map(np.array,(so,ao,co,do)); R=np.zeros((L,E)); r=np.zeros(E)
    for k in range(L-1,-1,-1): r=np.where(do[k],-1.,-1+G*r); R[k]=r
    tt=torch.as_tensor
    return tt(so),tt(ao),tt(co),tt(R)
th=torch.zeros(N,S,A,dtype=torch.float64,requires_grad=True); v=torch.zeros(N,S,dtype=torch.float64,requires_grad=True)
opt=torch.optim.Adam([th,v],lr=.05); U=100
t0=time.time()
for i in range(U):
    P=torch.softmax(th.detach(),-1).numpy(); s,a,c,R=roll(P,False); s2,a2,c2,R2=roll(P,True)
    lp=torch.log_softmax(th,-1); v1=v[c,s]; v2=v[c2,s2]
    H=lambda c,s:-(lp[c,s].exp()*lp[c,s]).sum(-1).mean()
    l=-(lp[c,s,a]*(R-v1).detach()).mean()-(lp[c2,s2,a2]*(-B*R2-v2).detach()).mean()+.5*(.5*((v1-R)**2).mean()+.5*((v2+B*R2)**2).mean())-(0.5-0.495*i/732)*(H(c,s)+H(c2,s2))
    opt.zero_grad(); l.backward(); opt.step()
d=time.time()-t0; print('torch+numpy: %.2f s for %d updates -> %.1f s for 732'%(d,U,d/U*732))
